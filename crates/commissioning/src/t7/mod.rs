//! Operations on US Digital T7s. Source: T7 Communication User Guide 1.7.

mod address;
mod all;
mod axis;
mod baud;
mod device;
mod error;
mod identify;
mod set;
mod setting;
mod sweep;
mod zero;

pub use address::ChangeAddress;
pub use all::{AskAll, Collected, Heard};
pub use baud::ChangeBaud;
pub use device::{Device, NotOneDevice};
pub use error::{Cause, Failure, Fault};
pub use identify::{Identify, Identity};
pub use set::Set;
pub use setting::DeviceSetting;
pub use sweep::{Found, Rates, Sweep, Swept};
pub use zero::{SetZero, ZERO_TOLERANCE, Zeroed};

use clino_bus::Duration;

/// A T7 that has heard a few bytes of something else takes them for the beginning of a command, and is deaf to real
/// ones until it gives up: 500 ms after the first byte (section 1). A tenth more for its clock.
pub const RESYNC: Duration = Duration::from_millis(550);

/// From the answer to Set Baud Rate until the device has changed: "about 10 milliseconds" (section 2.7.2), twice.
pub const BAUD_CHANGE: Duration = Duration::from_millis(20);
