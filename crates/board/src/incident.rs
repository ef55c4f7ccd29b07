//! What befell the chip itself: resets, planted faults, a crystal that stops. Instants are ns since power-up.

use std::fmt;

use clino_sim::node::Ns;

use crate::plant::{Level, What};

/// One thing that befell the chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Incident {
    /// When.
    pub at: Ns,
    /// What.
    pub event: Event,
}

/// What can befall the chip.
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
    },
    /// The core cannot go on: a fault within the handler of a fault. Only a reset ends that.
    Lockup,
    /// The whole chip was reset; it starts again at this instant.
    Reset(ResetCause),
}

/// Why the chip was reset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResetCause {
    /// The independent watchdog was not fed.
    Watchdog,
    /// Firmware asked for it (SYSRESETREQ).
    Software,
}

impl fmt::Display for Incident {
    /// A line of the bus log: time, `board`, what, who, details.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let at = self.at;
        match self.event {
            Event::Planted { what, level, pc } => {
                write!(f, "{at:>12} board {:<10} {level} {what} pc={pc:#010x}", "planted")
            }
            Event::Lockup => write!(f, "{at:>12} board {:<10} core", "lockup"),
            Event::Reset(cause) => write!(f, "{at:>12} board {:<10} chip {cause}", "reset"),
        }
    }
}

impl fmt::Display for ResetCause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            ResetCause::Watchdog => "watchdog",
            ResetCause::Software => "software",
        })
    }
}
