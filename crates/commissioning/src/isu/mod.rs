//! Operations on STT ISUs, binary mode. Source: AN #201, Interfacing to an ISU Module.
//!
//! # The EEPROM, and power failing in the middle
//!
//! A change takes two writes: the data, then the checksum. When power fails between them, the module comes up in its
//! Hard Error state and [`Repair`] brings it back: it recomputes the checksum over what is there. The upper 14 bits of
//! every word are the manufacturer's; they are written back as two readings of them agreed.
//!
//! An address change that is cut between its two words leaves a third address, made of half the old and half the new
//! one. [`Repair::after_address_change`] looks there too. Where that third address is 0 or 15, the module can be reached
//! [single](Module::single) only.

mod boot;
mod error;
mod identify;
mod image;
mod module;
mod null;
mod program;
mod question;
pub mod raw;
mod repair;
mod reset;
mod talk;
mod writer;

pub use boot::Alive;
pub use error::{Cause, Failure, Fault};
pub use identify::{Identify, Identity};
pub use module::{Module, NotOneModule};
pub use null::{NULL_TOLERANCE, Nulled, ResetNull};
pub use program::Program;
pub use question::{GoToSoftError, Question, ReadAngle};
pub use repair::{Repair, Repaired};
pub use reset::Reset;

use clino_bus::Duration;

/// Wait after a reset before the first request to the module. The document gives no figure; this is
/// a fifth of the time that a new angle takes.
pub const BOOT_FIRST: Duration = Duration::from_millis(100);

/// Pause between two attempts to reach a module that boots: longer than the 400 ms after which it forgets half a command
/// (section 4, Command Timeout).
pub const BOOT_AGAIN: Duration = Duration::from_millis(450);

/// A module that does not answer for this long after a reset will not: almost ten times what a new angle takes.
pub const BOOT_LIMIT: Duration = Duration::from_millis(5_000);

/// From one angle to the next: 8/15 s (section 4).
pub const REFRESH: Duration = Duration::from_micros(533_333);

/// After this there is a new angle: 8/15 s (section 4), an eighth more for the module's clock.
pub const NEW_ANGLE: Duration = Duration::from_millis(600);
