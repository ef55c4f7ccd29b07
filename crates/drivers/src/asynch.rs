//! The drivers over an [`AsyncPort`](crate::AsyncPort); their methods are those of the blocking drivers.
//!
//! Every future may be dropped at any time:
//!
//! - DE is low at once;
//! - an answer that may still come is waited for, and thrown away, before the next request;
//! - after a frame that was cut, the next request waits until every sensor has forgotten the half it heard: 500 ms (T7)
//!   or 400 ms (ISU), the documents' limits for a whole command.
//!
//! Nothing tells the time when a character comes. So the measured response times of [`BusCounters`](crate::BusCounters) are
//! those of the deadline here, and an answer that breaks off is given up at the latest possible time.

mod isu;
mod t7;

pub use isu::SttIsu;
pub use t7::UsDigitalT7;
