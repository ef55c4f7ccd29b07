//! US Digital T7 inclinometers: the binary protocol of T7-1-232, T7-1-485 and T7-3.
//!
//! Source: T7 Communication User Guide, version 1.7.
//!
//! ```text
//!             ┌─────────┬────────┬─────────┬──────────────┬──────────┐
//! command     │ address │ length │ command │ parameters   │ checksum │  checksum: Set commands only
//!             ├─────────┼────────┼─────────┼──────────────┼──────────┤
//! answer      │ address │ length │ command │ data | status│ checksum │  always
//!             └─────────┴────────┴─────────┴──────────────┴──────────┘
//!                                 └───────── length ─────────────────┘
//! ```
//!
//! - All numbers are big-endian, two's complement unless said otherwise; the line is 8N1.
//! - The checksum is the negated low byte of the sum of everything before it: a whole frame sums to zero.
//! - Devices only speak when spoken to: within 2 ms after a Get, within 25 ms after a Set command. A command
//!   must arrive within 500 ms, first byte to last. Times are the caller's business.
//! - Roll Call is named in §1.4, but was removed in version 1.7 and never described: it does not exist here.
//!   Devices are found by asking every address of [`Address::sweep`] at every rate of [`BaudRate::ALL`].

mod address;
mod answer;
mod decoder;
mod envelope;
mod error;
mod fields;
mod frame;
mod information;
mod opcode;
mod parameters;
mod reader;
mod request;
mod response;
mod sniffer;
mod status;
mod units;

pub use address::{Address, InvalidAddress};
pub use answer::{Answer, Expected};
pub use decoder::{AnswerDecoder, DecodeProgress};
pub use error::{DecodeError, Differs, EncodeError, Field};
pub use frame::{AnswerFrame, CommandFrame, Frame};
pub use information::{DeviceInformation, Text};
pub use opcode::Opcode;
pub use parameters::{Axis, BaudRate, DeviceType, Direction, MAX_DAMPING_MS, MIN_DAMPING_MS};
pub use reader::{AnswerReader, AsAsked};
pub use request::{Command, Request};
pub use response::Response;
pub use sniffer::{SniffProgress, Sniffed, Sniffer};
pub use status::{Status, UnknownStatus};
pub use units::{Acceleration, Millidegrees, Temperature};

pub use crate::checks::Checks;
