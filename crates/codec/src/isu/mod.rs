//! STT ISU inclinometers: the two-way binary protocol, and the EEPROM behind it.
//!
//! Source: STT, AN #201, Interfacing to an ISU Module.
//!
//! ```text
//! byte        0         1                                2 … N        N+1
//!         ┌────────┬─────────────────────────────────┬───────────┬──────────┐
//!         │ length │ address:4  function:3  answer:1 │ payload   │ checksum │
//!         └────────┴─────────────────────────────────┴───────────┴──────────┘
//!                   └───────────── length ──────────────────────┘
//! ```
//!
//! - The checksum is the low byte of the plain sum of bytes 1…N: the length byte is not in it, and unlike the
//!   T7's it is not negated.
//! - 16-bit numbers are sent high byte first; the line is 9600 bit/s, 8N1.
//! - A module cannot hear while it sends, and discards commands that take longer than 400 ms. A new angle
//!   appears every 8/15 s. Times are the caller's business.
//! - Error answers carry address 15 and name no module: they belong to the transaction in flight.

mod address;
mod data;
mod decoder;
pub mod eeprom;
mod error;
mod expected;
mod frame;
mod function;
mod parts;
mod request;
mod response;

pub use address::{Address, InvalidAddress};
pub use data::{Data, MAX_DATA, MAX_WORDS, Words};
pub use decoder::{AnswerDecoder, DecodeProgress};
pub use error::{DecodeError, DeviceError, Differs, EncodeError};
pub use expected::Expected;
pub use frame::Frame;
pub use function::Function;
pub use request::{Command, Request};
pub use response::{Answer, Response};

pub use crate::checks::Checks;

/// RAM address of the current angle, high byte first. Source: table 3.
pub const ANGLE_RAM_ADDRESS: u8 = 0x58;
/// Bytes of the current angle. Source: table 3.
pub const ANGLE_RAM_BYTES: u8 = 2;
