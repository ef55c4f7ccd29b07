//! Why a message could not be encoded or decoded, and the errors that modules report.

use core::fmt;

use super::{Address, Function};
use crate::character::LineErrors;
use crate::checks::Check;

/// What a module answers instead of a response. Source: AN #201 §4.
///
/// These answers name no module: they belong to the transaction in flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum DeviceError {
    /// `01 FF FF`: the command had function code 7.
    InvalidFunctionCode,
    /// `01 FD FD`: the command arrived damaged.
    InvalidChecksum,
    /// `02 F1 …`: the module is in the Hard Error state, and answers everything but Go To Soft Error State
    /// so.
    HardwareError {
        /// "Function code from initial command message", as sent.
        command_byte: u8,
    },
}

/// The caller asked for a message that must not be sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum EncodeError {
    /// Address 15 belongs to no module.
    ReservedAddress,
    /// Nothing to transfer, or more than one message can carry.
    Count {
        /// Bytes of RAM or words of EEPROM.
        count: usize,
        /// Most that one message can carry; the least is one.
        max: usize,
    },
    /// The transfer would go beyond address FF.
    BeyondEnd {
        /// First address.
        start: u8,
        /// Bytes of RAM or words of EEPROM.
        count: usize,
    },
    /// The write touches memory that the document does not name; most such writes destroy the module.
    Undocumented {
        /// First address.
        start: u8,
        /// Bytes of RAM or words of EEPROM.
        count: usize,
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
    /// Not the number of bytes that the length byte announces.
    Size {
        /// How many there are.
        received: usize,
        /// How many there should be (at least).
        expected: u16,
    },
    /// The length byte cannot go with the function.
    Length {
        /// The length byte.
        length: u8,
        /// The function.
        function: Function,
    },
    /// The checksum does not fit. A module answers such a command with [`DeviceError::InvalidChecksum`].
    Checksum {
        /// The last byte.
        received: u8,
        /// What it should be.
        computed: u8,
    },
    /// Function code 7. A module answers such a command with [`DeviceError::InvalidFunctionCode`].
    UnknownFunction {
        /// The second byte.
        head: u8,
    },
    /// A command where an answer was looked for, or the other way round.
    Direction {
        /// The second byte.
        head: u8,
    },
    /// The reserved address 15, in something that is not an error answer.
    ReservedAddress {
        /// The second byte.
        head: u8,
    },
    /// An intact answer, but not the one that was asked for.
    Foreign {
        /// Sender.
        address: Address,
        /// What it answers.
        function: Function,
        /// In what it differs from what was expected.
        differs: Differs,
    },
    /// The right module and function, but about another place in memory.
    Memory {
        /// Address and count in the answer.
        received: (u8, u8),
        /// Address and count of the command.
        expected: (u8, u8),
    },
}

/// In what a foreign answer differs from the expected one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Differs {
    /// Another module answered.
    Address,
    /// The right module answered another function.
    Function,
    /// Another module answered another function.
    Both,
}

impl DecodeError {
    /// The check that refused the message.
    pub const fn failed_check(&self) -> Check {
        match self {
            Self::LineErrors { .. } => Check::LineErrors,
            Self::Checksum { .. } => Check::Checksum,
            Self::ReservedAddress { .. }
            | Self::Foreign { differs: Differs::Address | Differs::Both, .. } => Check::Address,
            Self::UnknownFunction { .. }
            | Self::Direction { .. }
            | Self::Memory { .. }
            | Self::Foreign { differs: Differs::Function, .. } => Check::Command,
            Self::Size { .. } | Self::Length { .. } => Check::Length,
        }
    }
}

impl fmt::Display for DeviceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::InvalidFunctionCode => write!(f, "the module reports an invalid function code"),
            Self::InvalidChecksum => write!(f, "the module reports an invalid checksum"),
            Self::HardwareError { command_byte } => {
                write!(f, "the module is in its hard error state (command byte {command_byte:02X})")
            }
        }
    }
}

impl fmt::Display for EncodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ReservedAddress => write!(f, "address 15 is reserved"),
            Self::Count { count, max } => write!(f, "count {count} is not in 1..={max}"),
            Self::BeyondEnd { start, count } => write!(f, "{count} from {start:02X} on go beyond FF"),
            Self::Undocumented { start, count } => {
                write!(f, "{count} from {start:02X} on are not documented as writable")
            }
        }
    }
}

impl fmt::Display for DecodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::LineErrors { errors } => write!(f, "receiver errors: {errors:?}"),
            Self::Size { received, expected } => write!(f, "{received} bytes instead of {expected}"),
            Self::Length { length, function } => {
                write!(f, "length byte {length:02X} cannot go with {function:?}")
            }
            Self::Checksum { received, computed } => {
                write!(f, "checksum {received:02X} instead of {computed:02X}")
            }
            Self::UnknownFunction { head } => write!(f, "no function has the code in {head:02X}"),
            Self::Direction { head } => write!(f, "{head:02X} marks the wrong direction"),
            Self::ReservedAddress { head } => write!(f, "{head:02X} carries the reserved address"),
            Self::Foreign { address, function, .. } => {
                write!(f, "answer of address {} to {function:?}, which was not asked", address.get())
            }
            Self::Memory { received, expected } => {
                write!(f, "answer about {received:02X?} (address, count) instead of {expected:02X?}")
            }
        }
    }
}

impl core::error::Error for DeviceError {}
impl core::error::Error for EncodeError {}
impl core::error::Error for DecodeError {}
