//! Answers of modules. Source: AN #201 §4, appendix A.

use core::slice;

use super::data::{Data, Words};
use super::error::{DecodeError, DeviceError};
use super::frame::Frame;
use super::function::RESPONSE;
use super::parts::{HARDWARE_ERROR, INVALID_CHECKSUM, INVALID_FUNCTION_CODE, Parts};
use super::{ANGLE_RAM_ADDRESS, Address, Function};
use crate::angle::Angle;
use crate::bytes::Buffer;
use crate::checks::Checks;

/// The content of an answer, named like the command it answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Response {
    /// Done.
    GoToSoftErrorState,
    /// Done, or about to be.
    ResetModule,
    /// Bytes of RAM.
    ReadRam {
        /// First address.
        start: u8,
        /// The bytes.
        data: Data,
    },
    /// Done.
    WriteRam {
        /// First address.
        start: u8,
        /// The document calls this byte "Data Byte 1" where the answer to Write EEPROM has the count; either
        /// is accepted.
        count_or_first_byte: u8,
    },
    /// Words of EEPROM.
    ReadEeprom {
        /// First word address.
        start: u8,
        /// The words.
        words: Words,
    },
    /// Done.
    WriteEeprom {
        /// First word address.
        start: u8,
        /// Words written.
        count: u8,
    },
    /// Done.
    ResetNullPosition,
    /// The command was refused.
    Error(DeviceError),
}

/// An answer.
///
/// ```
/// use clino_codec::isu::{Address, Answer};
///
/// let answer = Answer::decode(&[0x04, 0x05, 0x58, 0x40, 0x00, 0x9D]).unwrap();
/// assert_eq!(answer.angle_word(), Some(0x4000));
/// assert_eq!(answer.angle().unwrap().to_string(), "90.000");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Answer {
    /// The module that answered; [`Address::RESERVED`] in the error answers, which name no module.
    pub address: Address,
    /// The response.
    pub response: Response,
}

impl Answer {
    /// Decodes bytes that are exactly one answer, from any module and to any request.
    ///
    /// # Errors
    /// Whatever is wrong with them.
    pub fn decode(bytes: &[u8]) -> Result<Self, DecodeError> {
        Self::decode_with(bytes, Checks::ALL)
    }

    /// As [`decode`](Self::decode), with the checksum check off if `checks` says so. The other checks need an
    /// expectation and play no part.
    ///
    /// # Errors
    /// Whatever is wrong with the bytes.
    pub fn decode_with(bytes: &[u8], checks: Checks) -> Result<Self, DecodeError> {
        let parts = Parts::open(bytes, RESPONSE, checks.checksum)?;
        Ok(Self { address: parts.address, response: Response::read(&parts) })
    }

    /// The answer as the module sends it.
    pub fn encode(&self) -> Frame {
        self.response.encode(self.address)
    }

    /// As [`Response::angle_word`].
    pub fn angle_word(&self) -> Option<u16> {
        self.response.angle_word()
    }

    /// The angle, if this answers [`Request::READ_ANGLE`](super::Request::READ_ANGLE): 0…359.99°, from the
    /// null position, clockwise.
    pub fn angle(&self) -> Option<Angle> {
        self.angle_word().map(Angle::from_turn16)
    }
}

impl Response {
    /// The function that is answered; `None` in the error answers, which do not say.
    pub const fn function(&self) -> Option<Function> {
        Some(match self {
            Self::GoToSoftErrorState => Function::GoToSoftErrorState,
            Self::ResetModule => Function::ResetModule,
            Self::ReadRam { .. } => Function::ReadRam,
            Self::WriteRam { .. } => Function::WriteRam,
            Self::ReadEeprom { .. } => Function::ReadEeprom,
            Self::WriteEeprom { .. } => Function::WriteEeprom,
            Self::ResetNullPosition => Function::ResetNullPosition,
            Self::Error(_) => return None,
        })
    }

    /// The angle as sent, in 360/65536°, if these are the two bytes of RAM that hold it.
    pub fn angle_word(&self) -> Option<u16> {
        match self {
            Self::ReadRam { start: ANGLE_RAM_ADDRESS, data } => match *data.as_slice() {
                [high, low] => Some(u16::from_be_bytes([high, low])),
                _ => None,
            },
            _ => None,
        }
    }

    /// The answer as a module with that address sends it. Error answers carry no address.
    pub fn encode(&self, address: Address) -> Frame {
        let head = match self {
            Self::Error(DeviceError::InvalidFunctionCode) => INVALID_FUNCTION_CODE,
            Self::Error(DeviceError::InvalidChecksum) => INVALID_CHECKSUM,
            Self::Error(DeviceError::HardwareError { .. }) => HARDWARE_ERROR,
            _ => self.function().map_or(0, |function| function.head(address)) | RESPONSE,
        };
        let (start, data) = match self {
            Self::ReadRam { start, data } => (start, data.as_slice()),
            Self::ReadEeprom { start, words } => (start, words.as_be_bytes()),
            Self::WriteRam { start, count_or_first_byte: third }
            | Self::WriteEeprom { start, count: third } => (start, slice::from_ref(third)),
            Self::Error(DeviceError::HardwareError { command_byte }) => (command_byte, &[][..]),
            _ => return Frame::new(head, &[], &[]),
        };
        Frame::new(head, slice::from_ref(start), data)
    }

    #[inline(always)]
    pub(super) fn read(parts: &Parts<'_>) -> Self {
        let (start, rest) = parts.memory();
        let third = rest.first().copied().unwrap_or(0);
        // Of the answers that carry data; empty in none of the others, and of no use there.
        let data = Buffer::first(rest);
        let Some(function) = parts.function else {
            return Self::Error(match parts.head {
                INVALID_FUNCTION_CODE => DeviceError::InvalidFunctionCode,
                INVALID_CHECKSUM => DeviceError::InvalidChecksum,
                _ => DeviceError::HardwareError { command_byte: start },
            });
        };
        match function {
            Function::GoToSoftErrorState => Self::GoToSoftErrorState,
            Function::ResetModule => Self::ResetModule,
            Function::ReadRam => Self::ReadRam { start, data: Data::of(data) },
            Function::WriteRam => Self::WriteRam { start, count_or_first_byte: third },
            Function::ReadEeprom => Self::ReadEeprom { start, words: Words::of(data) },
            Function::WriteEeprom => Self::WriteEeprom { start, count: third },
            Function::ResetNullPosition => Self::ResetNullPosition,
        }
    }
}

impl From<DeviceError> for Response {
    fn from(error: DeviceError) -> Self {
        Self::Error(error)
    }
}
