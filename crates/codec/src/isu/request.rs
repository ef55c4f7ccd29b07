//! Commands from the host to a module. Source: AN #201 table 1, appendix A.

use core::slice;

use super::data::{Data, MAX_DATA, MAX_WORDS, Words};
use super::error::{DecodeError, EncodeError};
use super::frame::Frame;
use super::parts::Parts;
use super::{ANGLE_RAM_ADDRESS, ANGLE_RAM_BYTES, Address, Expected, Function, eeprom};

/// Addresses in RAM, and words in EEPROM.
const MEMORY_SIZE: usize = 256;

/// A command.
///
/// ```
/// use clino_codec::isu::{Address, Request};
///
/// let frame = Request::READ_ANGLE.encode(Address::ANY).unwrap();
/// assert_eq!(frame.as_bytes(), [0x03, 0x04, 0x58, 0x02, 0x5E]);
/// assert_eq!(Request::decode(frame.as_bytes()).unwrap().request, Request::READ_ANGLE);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Request {
    /// Out of the Hard Error state; no effect in any other.
    GoToSoftErrorState,
    /// As if power had been cycled.
    ResetModule,
    /// Reads bytes of RAM.
    ReadRam {
        /// First address.
        start: u8,
        /// Bytes to read, at least one.
        count: u8,
    },
    /// Writes bytes of RAM.
    WriteRam {
        /// First address.
        start: u8,
        /// The bytes, at least one.
        data: Data,
    },
    /// Reads words of EEPROM.
    ReadEeprom {
        /// First word address.
        start: u8,
        /// Words to read, at least one.
        count: u8,
    },
    /// Writes words of EEPROM. Use a [plan](eeprom::Plan): a wrong checksum in EEPROM disables the module.
    WriteEeprom {
        /// First word address.
        start: u8,
        /// The words, at least one.
        words: Words,
    },
    /// The current angle becomes zero.
    ResetNullPosition,
}

/// A command and its addressee.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Command {
    /// The module, or [`Address::ANY`].
    pub address: Address,
    /// What it is asked.
    pub request: Request,
}

impl Request {
    /// Reads the current angle: two bytes of RAM. A new one appears every 8/15 s.
    pub const READ_ANGLE: Self = Self::ReadRam { start: ANGLE_RAM_ADDRESS, count: ANGLE_RAM_BYTES };

    /// The function code.
    pub const fn function(&self) -> Function {
        match self {
            Self::GoToSoftErrorState => Function::GoToSoftErrorState,
            Self::ResetModule => Function::ResetModule,
            Self::ReadRam { .. } => Function::ReadRam,
            Self::WriteRam { .. } => Function::WriteRam,
            Self::ReadEeprom { .. } => Function::ReadEeprom,
            Self::WriteEeprom { .. } => Function::WriteEeprom,
            Self::ResetNullPosition => Function::ResetNullPosition,
        }
    }

    /// What the answer to this command, sent to `address`, has to be.
    pub fn expected(&self, address: Address) -> Expected {
        let (length, start, count, or_count) = match self {
            Self::ReadRam { start, count } => (count.saturating_add(2), *start, *count, *count),
            Self::ReadEeprom { start, count } => {
                (count.saturating_mul(2).saturating_add(2), *start, *count, *count)
            }
            Self::WriteRam { start, data } => {
                let bytes = data.as_slice();
                let count = bytes.len() as u8;
                (3, *start, count, bytes.first().copied().unwrap_or(count))
            }
            Self::WriteEeprom { start, words } => {
                let count = words.len() as u8;
                (3, *start, count, count)
            }
            Self::GoToSoftErrorState | Self::ResetModule | Self::ResetNullPosition => (1, 0, 0, 0),
        };
        Expected { address, function: self.function(), length, start, count, or_count }
    }

    /// The command as it goes over the line.
    ///
    /// # Errors
    /// [`EncodeError`]: the reserved address, an impossible count or range, or a write outside the places
    /// that the document names (RAM 58–59, EEPROM 48–57, 78–7F, D0–D7).
    pub fn encode(&self, address: Address) -> Result<Frame, EncodeError> {
        let documented = match self {
            Self::WriteRam { start, data } => is_documented_ram(*start, data.as_slice().len()),
            Self::WriteEeprom { start, words } => eeprom::is_documented(*start, words.len()),
            _ => true,
        };
        self.check(address)?;
        match self.span() {
            Some((start, count, _)) if !documented => Err(EncodeError::Undocumented { start, count }),
            _ => Ok(self.frame(address)),
        }
    }

    /// As [`encode`](Self::encode), writes to any memory included.
    ///
    /// "Modification of other data will most likely render the module inoperable and irreparable" (AN #201
    /// §6).
    ///
    /// # Errors
    /// [`EncodeError`], except `Undocumented`.
    pub fn encode_even_if_it_bricks_the_module(&self, address: Address) -> Result<Frame, EncodeError> {
        self.check(address)?;
        Ok(self.frame(address))
    }

    /// Whether there can be such a message.
    fn check(&self, address: Address) -> Result<(), EncodeError> {
        if address.is_reserved() {
            return Err(EncodeError::ReservedAddress);
        }
        if let Some((start, count, max)) = self.span() {
            if count == 0 || count > max {
                return Err(EncodeError::Count { count, max });
            }
            if usize::from(start).saturating_add(count) > MEMORY_SIZE {
                return Err(EncodeError::BeyondEnd { start, count });
            }
        }
        Ok(())
    }

    fn frame(&self, address: Address) -> Frame {
        let head = self.function().head(address);
        let (start, data) = match self {
            Self::ReadRam { start, count } | Self::ReadEeprom { start, count } => {
                (start, slice::from_ref(count))
            }
            Self::WriteRam { start, data } => (start, data.as_slice()),
            Self::WriteEeprom { start, words } => (start, words.as_be_bytes()),
            _ => return Frame::new(head, &[], &[]),
        };
        Frame::new(head, slice::from_ref(start), data)
    }

    /// The command that these bytes are, whole and exactly.
    ///
    /// # Errors
    /// Whatever is wrong with them.
    pub fn decode(bytes: &[u8]) -> Result<Command, DecodeError> {
        let parts = Parts::open(bytes, 0, true)?;
        // Error answers are answers.
        let function = parts.function.ok_or(DecodeError::Direction { head: parts.head })?;
        let (start, rest) = parts.memory();
        let count = rest.first().copied().unwrap_or(0);
        let request = match function {
            Function::GoToSoftErrorState => Self::GoToSoftErrorState,
            Function::ResetModule => Self::ResetModule,
            Function::ReadRam => Self::ReadRam { start, count },
            Function::WriteRam => Self::WriteRam { start, data: Data::first(rest) },
            Function::ReadEeprom => Self::ReadEeprom { start, count },
            Function::WriteEeprom => Self::WriteEeprom { start, words: Words::from_be_bytes(rest) },
            Function::ResetNullPosition => Self::ResetNullPosition,
        };
        Ok(Command { address: parts.address, request })
    }

    /// First address, count, and the largest possible count of a memory transfer.
    fn span(&self) -> Option<(u8, usize, usize)> {
        match self {
            Self::ReadRam { start, count } => Some((*start, usize::from(*count), MAX_DATA)),
            Self::WriteRam { start, data } => Some((*start, data.as_slice().len(), MAX_DATA)),
            Self::ReadEeprom { start, count } => Some((*start, usize::from(*count), MAX_WORDS)),
            Self::WriteEeprom { start, words } => Some((*start, words.len(), MAX_WORDS)),
            _ => None,
        }
    }
}

/// Whether the document names these bytes of RAM: the current angle is all it names. Source: table 3.
fn is_documented_ram(start: u8, count: usize) -> bool {
    let first = usize::from(ANGLE_RAM_ADDRESS);
    let end = usize::from(start).saturating_add(count);
    usize::from(start) >= first && end <= first.saturating_add(usize::from(ANGLE_RAM_BYTES))
}
