//! The ISU's ASCII output mode: one line on demand, or lines for as long as they are wanted.
//!
//! ```text
//! OneLine   RX  ‾‾‾‾\________120 ms________/‾‾‾‾    a line comes 100 ms after the edge, or when the one
//!               RX has been high since the reset     before is 533 ms old
//!
//! Lines     RX  ‾‾‾\__________________________/‾‾‾  a line with every new angle, until cancelled
//!           RST ‾‾‾‾‾\__10 ms__/‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾‾
//! ```
//! The operations say which pin has to do what ([`Step::Pin`]); [`PinStep::apply`] does it through [`Pins`], three lines
//! of code on any board. Characters from the module's TX go to `hear`. RX is held with a UART's break or by taking its
//! pin over; on the module, TX is a line of its own.
//!
//! Source: AN #201 section 2 (RESET), section 4 (ASCII Output Mode).

use core::fmt;

use clino_bus::{Duration, Instant, Serial};
use clino_codec::DecodeProgress as Decoding;
use clino_codec::ascii::{Centidegrees, LINE_LENGTH, LineDecoder, LineFault};
use clino_codec::character::Character;

use crate::isu::{BOOT_LIMIT, NEW_ANGLE};

/// How long RX is held low for one line: "at least 100msec", a fifth more for either clock.
pub const LOW_PULSE: Duration = Duration::from_millis(120);

/// How long RESET is held low. The document does not say; the 68HC05 in the module needs a few of its clock cycles, and a
/// long wire with a filter a millisecond.
pub const RESET_PULSE: Duration = Duration::from_millis(10);

/// A line has to come within this from the falling edge: the 533 ms that lines are apart at least, the 100 ms of the
/// pulse, the line itself, and some.
const LINE_LIMIT: Duration = Duration::from_millis(800);

/// In continuous output a line may be missed; two in a row, and it has stopped.
const SILENCE_LIMIT: Duration = NEW_ANGLE.times(3);

/// The module's pins, as far as the gateway drives them.
pub trait Pins {
    /// Pulls the module's RX low, or lets it go (idle, high).
    fn rx_low(&mut self, low: bool);
    /// Pulls the module's RESET low, or lets it go.
    fn reset_low(&mut self, low: bool);
}

/// What a pin has to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum PinStep {
    /// RX low, or released.
    RxLow(bool),
    /// RESET low, or released.
    ResetLow(bool),
}

impl PinStep {
    /// Does it.
    pub fn apply(self, pins: &mut impl Pins) {
        match self {
            Self::RxLow(low) => pins.rx_low(low),
            Self::ResetLow(low) => pins.reset_low(low),
        }
    }
}

/// What an operation wants next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum Step<R> {
    /// This, now; then ask again. Said once and taken as done.
    Pin(PinStep),
    /// Nothing before that instant, except to hear characters; ask again after each line.
    Wait {
        /// When to ask again.
        until: Instant,
    },
    /// The end, with RX and RESET released. Asking again gives the same.
    Done(Result<R, NoLine>),
}

/// No line came in time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum NoLine {
    /// Nothing at all.
    Silent {
        /// How long it was waited for.
        waited: Duration,
        /// Good lines before that.
        lines: u32,
    },
    /// Something, but no good line.
    Bad(LineFault),
    /// The caller stopped it.
    Cancelled,
}

/// One line by a low pulse on RX. RX has to be high before, and to have been high at the last reset.
#[derive(Clone, Debug)]
pub struct OneLine {
    state: Once,
    decoder: LineDecoder,
    heard: Option<Result<Centidegrees, NoLine>>,
}

#[derive(Clone, Copy, Debug)]
enum Once {
    Fall,
    Low { fell: Instant },
    High { fell: Instant },
    Ended(Result<Centidegrees, NoLine>),
}

impl OneLine {
    /// Begins with the falling edge.
    pub const fn new() -> OneLine {
        OneLine { state: Once::Fall, decoder: LineDecoder::new(), heard: None }
    }

    /// What to do next.
    pub fn next(&mut self, now: Instant) -> Step<Centidegrees> {
        match self.state {
            Once::Fall => {
                self.state = Once::Low { fell: now };
                Step::Pin(PinStep::RxLow(true))
            }
            Once::Low { fell } if now < fell + LOW_PULSE => Step::Wait { until: fell + LOW_PULSE },
            Once::Low { fell } => {
                self.state = Once::High { fell };
                Step::Pin(PinStep::RxLow(false))
            }
            Once::High { fell } => {
                let late = now >= fell + LINE_LIMIT;
                match self.heard {
                    Some(Ok(line)) => self.end(Ok(line)),
                    Some(Err(NoLine::Cancelled)) => self.end(Err(NoLine::Cancelled)),
                    Some(Err(bad)) if late => self.end(Err(bad)),
                    None if late => self.end(Err(NoLine::Silent { waited: now.since(fell), lines: 0 })),
                    _ => Step::Wait { until: fell + LINE_LIMIT },
                }
            }
            Once::Ended(result) => Step::Done(result),
        }
    }

    /// A character has come from the module; `true` when a good line is complete.
    pub fn hear(&mut self, character: Character) -> bool {
        if matches!(self.state, Once::Fall | Once::Ended(_)) {
            return false;
        }
        match self.decoder.push(character) {
            Decoding::More => false,
            Decoding::Frame(line) => {
                self.heard = self.heard.filter(Result::is_ok).or(Some(Ok(line)));
                true
            }
            Decoding::Bad(fault) => {
                self.heard.get_or_insert(Err(NoLine::Bad(fault)));
                false
            }
        }
    }

    /// Stop; RX is released first.
    pub fn cancel(&mut self) {
        match self.state {
            Once::Fall => self.state = Once::Ended(Err(NoLine::Cancelled)),
            // Enough of the pulse has been seen.
            Once::Low { .. } => {
                self.state = Once::Low { fell: Instant::ZERO };
                self.heard = Some(Err(NoLine::Cancelled));
            }
            Once::High { .. } => self.heard = Some(Err(NoLine::Cancelled)),
            Once::Ended(_) => {}
        }
    }

    fn end(&mut self, result: Result<Centidegrees, NoLine>) -> Step<Centidegrees> {
        self.state = Once::Ended(result);
        Step::Done(result)
    }
}

impl Default for OneLine {
    fn default() -> Self {
        Self::new()
    }
}

/// Lines for as long as they are wanted: holds RX low over a reset, and until cancelled.
#[derive(Clone, Debug)]
pub struct Lines {
    state: Continuous,
    decoder: LineDecoder,
    lines: u32,
    cancelled: bool,
}

#[derive(Clone, Copy, Debug)]
enum Continuous {
    HoldRx,
    PullReset,
    Reset { until: Instant },
    Listen { since: Instant, until: Instant },
    Ended(Result<u32, NoLine>),
}

impl Lines {
    /// Begins with RX low, then a reset.
    pub const fn new() -> Lines {
        Lines { state: Continuous::HoldRx, decoder: LineDecoder::new(), lines: 0, cancelled: false }
    }

    /// What to do next. The report is the number of good lines.
    pub fn next(&mut self, now: Instant) -> Step<u32> {
        let (pin, state) = match self.state {
            Continuous::HoldRx if self.cancelled => {
                self.state = Continuous::Ended(Ok(0));
                return Step::Done(Ok(0));
            }
            Continuous::HoldRx => (PinStep::RxLow(true), Continuous::PullReset),
            Continuous::PullReset | Continuous::Listen { .. } if self.cancelled => {
                (PinStep::RxLow(false), Continuous::Ended(Ok(self.lines)))
            }
            Continuous::PullReset => {
                (PinStep::ResetLow(true), Continuous::Reset { until: now + RESET_PULSE })
            }
            Continuous::Reset { until } if now < until => return Step::Wait { until },
            Continuous::Reset { .. } => {
                let until = now + BOOT_LIMIT;
                (PinStep::ResetLow(false), Continuous::Listen { since: now, until })
            }
            Continuous::Listen { until, .. } if now < until => return Step::Wait { until },
            Continuous::Listen { since, .. } => {
                let silent = NoLine::Silent { waited: now.since(since), lines: self.lines };
                (PinStep::RxLow(false), Continuous::Ended(Err(silent)))
            }
            Continuous::Ended(result) => return Step::Done(result),
        };
        self.state = state;
        Step::Pin(pin)
    }

    /// A character has come from the module at `at`: a line, or what is wrong with one, when it is complete.
    pub fn hear(&mut self, character: Character, at: Instant) -> Option<Result<Centidegrees, LineFault>> {
        let Continuous::Listen { .. } = self.state else { return None };
        match self.decoder.push(character) {
            Decoding::More => None,
            Decoding::Frame(line) => {
                self.lines = self.lines.saturating_add(1);
                self.state = Continuous::Listen { since: at, until: at + SILENCE_LIMIT };
                Some(Ok(line))
            }
            Decoding::Bad(fault) => Some(Err(fault)),
        }
    }

    /// Enough: RX is released, and the end is the number of lines.
    pub fn cancel(&mut self) {
        self.cancelled = true;
    }
}

impl Default for Lines {
    fn default() -> Self {
        Self::new()
    }
}

impl fmt::Display for NoLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Silent { waited, lines } => {
                write!(f, "no line for {} ms, after {lines} good ones", waited.as_millis())
            }
            Self::Bad(fault) => write!(f, "no good line: {fault}"),
            Self::Cancelled => write!(f, "cancelled"),
        }
    }
}

impl core::error::Error for NoLine {}

// A pulse, the pause between lines and a line with its lead fit into the limit (AN #201 sections 2 and 4).
const _: () = {
    let line = Serial::ISU.characters(LINE_LENGTH as u32).as_micros();
    assert!(LOW_PULSE.as_micros() + 533_334 + 1_000 + line < LINE_LIMIT.as_micros());
};
