//! Outcome of a Set command. Source: T7 guide §1.3.

use core::fmt;

/// The status byte of an answer to a Set command.
///
/// Every one of the 256 codes survives decoding and encoding, the reserved ones (2 and 6) included.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(from = "u8", into = "u8"))]
#[repr(u8)]
pub enum Status {
    /// 0: done.
    Success = 0,
    /// 1: the device knows no such command.
    InvalidCommand = 1,
    /// 3: a parameter is out of range.
    InvalidParameter = 3,
    /// 4: the command arrived damaged.
    ChecksumError = 4,
    /// 5: the command failed.
    CommandFailed = 5,
    /// 7: the non-volatile memory could not be erased.
    FlashEraseError = 7,
    /// 8: the non-volatile memory could not be programmed.
    FlashProgramError = 8,
    /// 9: the address is out of range.
    AddressOutOfRange = 9,
    /// A reserved or undocumented code.
    Unknown(UnknownStatus) = u8::MAX,
}

/// A status code to which the guide gives no meaning.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct UnknownStatus(u8);

impl UnknownStatus {
    /// The code.
    pub const fn get(self) -> u8 {
        self.0
    }
}

impl Status {
    /// The meaning of a code.
    pub const fn new(code: u8) -> Self {
        match code {
            0 => Self::Success,
            1 => Self::InvalidCommand,
            3 => Self::InvalidParameter,
            4 => Self::ChecksumError,
            5 => Self::CommandFailed,
            7 => Self::FlashEraseError,
            8 => Self::FlashProgramError,
            9 => Self::AddressOutOfRange,
            unknown => Self::Unknown(UnknownStatus(unknown)),
        }
    }

    /// The code.
    pub const fn get(self) -> u8 {
        match self {
            Self::Success => 0,
            Self::InvalidCommand => 1,
            Self::InvalidParameter => 3,
            Self::ChecksumError => 4,
            Self::CommandFailed => 5,
            Self::FlashEraseError => 7,
            Self::FlashProgramError => 8,
            Self::AddressOutOfRange => 9,
            Self::Unknown(UnknownStatus(code)) => code,
        }
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let meaning = match self {
            Self::Success => "success",
            Self::InvalidCommand => "invalid command",
            Self::InvalidParameter => "invalid parameter",
            Self::ChecksumError => "the command arrived damaged",
            Self::CommandFailed => "the command failed",
            Self::FlashEraseError => "its memory could not be erased",
            Self::FlashProgramError => "its memory could not be written",
            Self::AddressOutOfRange => "address out of range",
            Self::Unknown(_) => "no documented meaning",
        };
        write!(f, "status {}, {meaning}", self.get())
    }
}

impl From<u8> for Status {
    fn from(code: u8) -> Self {
        Self::new(code)
    }
}

impl From<Status> for u8 {
    fn from(status: Status) -> Self {
        status.get()
    }
}
