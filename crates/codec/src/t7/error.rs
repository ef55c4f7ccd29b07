//! Why a message could not be encoded or decoded.

use core::fmt;

use super::{Address, Opcode};
use crate::character::LineErrors;
use crate::checks::Check;

/// The caller asked for a message that must not be sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum EncodeError {
    /// The all-respond address takes only commands whose response length value is at most eight.
    NotForAll {
        /// The command.
        opcode: Opcode,
        /// Its response length value.
        response_length: u8,
    },
    /// A parameter is out of range.
    OutOfRange {
        /// Which one.
        field: Field,
        /// What was asked for.
        value: i32,
        /// Lowest value allowed.
        min: i32,
        /// Highest value allowed.
        max: i32,
    },
}

/// Bytes are not the message they should be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum DecodeError {
    /// The receiver complained about a character of the frame.
    LineErrors {
        /// All complaints of the frame.
        errors: LineErrors,
    },
    /// Not the number of bytes that this message has.
    Size {
        /// How many there are.
        received: usize,
        /// How many there should be (at least).
        expected: usize,
    },
    /// The length byte does not fit the command.
    Length {
        /// The length byte.
        received: u8,
        /// The right one.
        expected: u8,
    },
    /// The checksum does not fit.
    Checksum {
        /// The last byte.
        received: u8,
        /// What it should be.
        computed: u8,
    },
    /// No device can have this address.
    UnknownAddress {
        /// The address byte.
        address: u8,
    },
    /// No command has this code.
    UnknownCommand {
        /// The command byte.
        command: u8,
    },
    /// An intact answer, but not the one that was asked for.
    Foreign {
        /// Sender.
        address: Address,
        /// What it answers.
        opcode: Opcode,
        /// In what it differs from what was expected.
        differs: Differs,
    },
    /// A value out of range, or a code without a meaning.
    Value {
        /// Which field.
        field: Field,
        /// Its value as sent.
        value: i32,
    },
}

/// In what a foreign answer differs from the expected one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Differs {
    /// Another device answered.
    Address,
    /// The right device answered another command.
    Command,
    /// Another device answered another command.
    Both,
}

/// A field of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Field {
    /// An angle in millidegrees.
    Angle,
    /// An angle offset in millidegrees.
    Offset,
    /// Number of an axis.
    Axis,
    /// Direction code.
    Direction,
    /// Damping time in milliseconds.
    Damping,
    /// Output range code.
    OutputRange,
    /// Baud rate index.
    BaudRate,
    /// Device type code.
    DeviceType,
    /// Address to be given to a device.
    NewAddress,
}

impl DecodeError {
    /// The check that refused the message.
    pub const fn failed_check(&self) -> Check {
        match self {
            Self::LineErrors { .. } => Check::LineErrors,
            Self::Checksum { .. } => Check::Checksum,
            Self::UnknownAddress { .. } | Self::Foreign { differs: Differs::Address | Differs::Both, .. } => {
                Check::Address
            }
            Self::UnknownCommand { .. } | Self::Foreign { differs: Differs::Command, .. } => Check::Command,
            Self::Size { .. } | Self::Length { .. } => Check::Length,
            Self::Value { .. } => Check::Value,
        }
    }
}

impl fmt::Display for EncodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotForAll { opcode, response_length } => write!(
                f,
                "{opcode:?} must not go to the all-respond address: its response length {response_length} exceeds 8"
            ),
            Self::OutOfRange { field, value, min, max } => {
                write!(f, "{field:?} {value} is not in {min}..={max}")
            }
        }
    }
}

impl fmt::Display for DecodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::LineErrors { errors } => write!(f, "receiver errors: {errors:?}"),
            Self::Size { received, expected } => write!(f, "{received} bytes instead of {expected}"),
            Self::Length { received, expected } => {
                write!(f, "length byte {received:02X} instead of {expected:02X}")
            }
            Self::Checksum { received, computed } => {
                write!(f, "checksum {received:02X} instead of {computed:02X}")
            }
            Self::UnknownAddress { address } => write!(f, "no device can have address {address}"),
            Self::UnknownCommand { command } => write!(f, "no command has code {command:02X}"),
            Self::Foreign { address, opcode, .. } => {
                write!(f, "answer of address {} to {opcode:?}, which was not asked", address.get())
            }
            Self::Value { field, value } => write!(f, "{field:?} cannot be {value}"),
        }
    }
}

impl core::error::Error for EncodeError {}
impl core::error::Error for DecodeError {}
