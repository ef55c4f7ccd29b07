//! When an ISU sends a line in ASCII mode.
//!
//! - RX low at power-up or reset, and low ever since: a line with every new angle.
//! - Otherwise: a line when RX has gone from high to low and stayed low for 100 ms, but never sooner than
//!   533 ms after the last; one that would be too soon waits.
//!
//! Source: "Interfacing to an ISU Module", section 4, "ASCII Output Mode".

use super::angle::REFRESH;
use crate::node::Ns;

/// How long RX must stay low after a falling edge.
const LOW_TIME: Ns = 100_000_000;

/// What the level on RX asks for.
#[derive(Clone, Copy, Debug)]
enum Wish {
    Nothing,
    /// RX has been low since power-up or reset: lines for ever, the next one at `due` once the module runs.
    Continuous {
        due: Option<Ns>,
    },
    /// RX fell while the module ran: one line.
    Single {
        fell_at: Ns,
        due: Ns,
    },
}

/// The level on the RX pin and what follows from it.
#[derive(Clone, Debug)]
pub(super) struct Ascii {
    rx_high: bool,
    wish: Wish,
    last_line: Option<Ns>,
}

impl Ascii {
    pub fn new() -> Self {
        Self { rx_high: true, wish: Wish::Nothing, last_line: None }
    }

    /// Power-up or reset begins: the level counts from here on.
    pub fn reset(&mut self) {
        self.wish = if self.rx_high { Wish::Nothing } else { Wish::Continuous { due: None } };
        self.last_line = None;
    }

    /// The module runs and has its first angle.
    pub fn ready(&mut self, now: Ns) {
        if let Wish::Continuous { due } = &mut self.wish {
            *due = Some(now);
        }
    }

    /// The level on RX changed; `running` if the module is there to notice.
    pub fn level(&mut self, now: Ns, high: bool, running: bool) {
        let fell = self.rx_high && !high;
        self.rx_high = high;
        self.wish = match self.wish {
            _ if fell && running => {
                let earliest = self.last_line.map_or(0, |last| last + REFRESH);
                Wish::Single { fell_at: now, due: earliest.max(now + LOW_TIME) }
            }
            Wish::Continuous { .. } if high => Wish::Nothing,
            Wish::Single { fell_at, .. } if high && now < fell_at + LOW_TIME => Wish::Nothing,
            other => other,
        };
    }

    /// When the next line is due.
    pub fn due(&self) -> Option<Ns> {
        match self.wish {
            Wish::Nothing => None,
            Wish::Continuous { due } => due,
            Wish::Single { due, .. } => Some(due),
        }
    }

    /// The line that was due has been dealt with; there will be a new angle at `next_angle`.
    pub fn done(&mut self, now: Ns, next_angle: Ns) {
        self.last_line = Some(now);
        self.wish = match self.wish {
            Wish::Continuous { .. } => Wish::Continuous { due: Some(next_angle) },
            Wish::Nothing | Wish::Single { .. } => Wish::Nothing,
        };
    }
}
