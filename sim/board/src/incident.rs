//! Incidents of the chip itself: resets, planted faults, a crystal that stops. Instants are ns since power-up.

use std::fmt;
use std::sync::Mutex;

use clino_sim::node::Ns;

use crate::injection::{Level, What};
use crate::timeline::lock;

/// One incident of the chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Incident {
    /// When.
    pub at: Ns,
    /// What.
    pub event: Event,
}

/// A kind of incident.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// A fault was planted: the next instruction is the first of it.
    Planted {
        /// What it does.
        what: What,
        /// Where.
        level: Level,
        /// Where the core would have gone on.
        pc: u32,
        /// Where it goes on: the address of the fault, or of the function that fails.
        to: u32,
    },
    /// The core cannot go on: a fault within the handler of a fault. Only a reset ends that.
    Lockup,
    /// The whole chip was reset; it starts again at this instant.
    Reset(ResetCause),
    /// The crystal stopped, or can swing again.
    Crystal {
        /// It swings.
        swings: bool,
    },
    /// The clock security system has put the core on the internal oscillator, and raised NMI.
    ClockSecurity,
}

/// Why the chip was reset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResetCause {
    /// The independent watchdog was not fed.
    Watchdog,
    /// Firmware asked for it (SYSRESETREQ).
    Software,
    /// The supply was too low.
    BrownOut,
    /// The reset pin was pulled.
    Pin,
}

/// Everything that has happened to the chip; each part records what it notices.
#[derive(Debug, Default)]
pub(crate) struct Chronicle(Mutex<Vec<Incident>>);

impl Chronicle {
    /// One more.
    pub fn note(&self, at: Ns, event: Event) {
        lock(&self.0).push(Incident { at, event });
    }

    /// All so far, in order.
    pub fn incidents(&self) -> Vec<Incident> {
        lock(&self.0).clone()
    }
}

impl fmt::Display for Incident {
    /// A line of the bus log: time, `board`, what, who, details.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let at = self.at;
        match self.event {
            Event::Planted { what, level, pc, to } => {
                write!(f, "{at:>12} board {:<10} {level} {what} pc={pc:#010x} to={to:#010x}", "planted")
            }
            Event::Lockup => write!(f, "{at:>12} board {:<10} core", "lockup"),
            Event::Reset(cause) => write!(f, "{at:>12} board {:<10} chip {cause}", "reset"),
            Event::Crystal { swings } => {
                let what = if swings { "swings" } else { "stands" };
                write!(f, "{at:>12} board {:<10} hse {what}", "crystal")
            }
            Event::ClockSecurity => write!(f, "{at:>12} board {:<10} core internal nmi", "clock"),
        }
    }
}

impl fmt::Display for ResetCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            ResetCause::Watchdog => "watchdog",
            ResetCause::Software => "software",
            ResetCause::BrownOut => "brown_out",
            ResetCause::Pin => "pin",
        })
    }
}
