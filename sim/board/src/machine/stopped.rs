//! Why the board stopped, and the message for it.

use std::fmt;

use clino_sim::node::Ns;

use crate::cpu::Fault;

/// Why the board does not run on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Stopped {
    /// Firmware is stuck in a fault handler, or locked up, and no watchdog is running that would end it.
    Faulted {
        /// When this was noticed: up to 2 ms after the fault.
        at: Ns,
        /// What the core knows of it.
        fault: Fault,
        /// The exception frame on the main stack as far as it is in RAM: R0–R3, R12, LR, PC, xPSR. A handler that
        /// has pushed something itself hides it.
        frame: [Option<u32>; 8],
    },
    /// The supply failed in the middle of a step of the flash, as
    /// [`Board::cut_power_at`](super::Board::cut_power_at) wanted.
    PowerLost {
        /// Up to 1 ms after that.
        at: Ns,
    },
    /// The emulator gave up.
    Emulator(String),
}

impl fmt::Display for Stopped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Stopped::PowerLost { at } => {
                write!(f, "the power was cut at {:.6} s, while flash was written", *at as f64 / 1e9)
            }
            Stopped::Emulator(why) => write!(f, "the emulator stopped: {why}"),
            Stopped::Faulted { at, fault, frame } => {
                let what = if fault.lockup { "locked up" } else { "is in a fault handler" };
                write!(
                    f,
                    "firmware {what} at {:.6} s: exception {}, PC {:#010x}, CFSR {:#010x}, HFSR {:#010x}, BFAR \
                     {:#010x}; stack at {:#010x}:",
                    *at as f64 / 1e9,
                    fault.exception,
                    fault.pc,
                    fault.cfsr,
                    fault.hfsr,
                    fault.bfar,
                    fault.sp
                )?;
                frame.iter().flatten().try_for_each(|word| write!(f, " {word:08x}"))
            }
        }
    }
}

impl std::error::Error for Stopped {}
