//! Function codes and the second byte of every message. Source: AN #201 tables 1 and 2.

use super::Address;

/// Lowest bit of the second byte: set in messages from a module to the host.
pub(super) const RESPONSE: u8 = 1;

/// One of the seven functions. Code 7 is invalid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(u8)]
pub enum Function {
    /// 000: from the Hard Error to the Soft Error state, in which the serial port works again.
    GoToSoftErrorState = 0,
    /// 001: as if power had been cycled.
    ResetModule = 1,
    /// 010.
    ReadRam = 2,
    /// 011.
    WriteRam = 3,
    /// 100.
    ReadEeprom = 4,
    /// 101.
    WriteEeprom = 5,
    /// 110: the current angle becomes zero. Table 2 calls it Reset Null Point.
    ResetNullPosition = 6,
}

impl Function {
    /// All functions, by code.
    pub const ALL: [Self; 7] = [
        Self::GoToSoftErrorState,
        Self::ResetModule,
        Self::ReadRam,
        Self::WriteRam,
        Self::ReadEeprom,
        Self::WriteEeprom,
        Self::ResetNullPosition,
    ];

    /// The function of that code.
    pub const fn new(code: u8) -> Option<Self> {
        Some(match code {
            0 => Self::GoToSoftErrorState,
            1 => Self::ResetModule,
            2 => Self::ReadRam,
            3 => Self::WriteRam,
            4 => Self::ReadEeprom,
            5 => Self::WriteEeprom,
            6 => Self::ResetNullPosition,
            _ => return None,
        })
    }

    /// The code, 0–6.
    pub const fn get(self) -> u8 {
        self as u8
    }

    /// Whether a command for this function can have that length byte.
    ///
    /// A module looks for such pairs of length and function to find the start of a command. Source: §4.
    pub const fn command_length_fits(self, length: u8) -> bool {
        self.length_fits(length, self.carries_data(false))
    }

    /// Whether an answer from this function can have that length byte.
    pub const fn response_length_fits(self, length: u8) -> bool {
        self.length_fits(length, self.carries_data(true))
    }

    /// Whether data are in the command, or in the answer.
    pub(super) const fn carries_data(self, answer: bool) -> bool {
        match self {
            Self::ReadRam | Self::ReadEeprom => answer,
            _ => !answer,
        }
    }

    /// Whether a message can have that length byte, in the direction in which data are carried or in the other.
    pub(super) const fn length_fits(self, length: u8, carries_data: bool) -> bool {
        match self {
            Self::GoToSoftErrorState | Self::ResetModule | Self::ResetNullPosition => length == 1,
            _ if !carries_data => length == 3,
            Self::ReadRam | Self::WriteRam => length >= 3,
            Self::ReadEeprom | Self::WriteEeprom => length >= 4 && length.is_multiple_of(2),
        }
    }

    /// The second byte of a command: address, function, and a zero bit.
    pub(super) const fn head(self, address: Address) -> u8 {
        address.get() << 4 | self.get() << 1
    }

    pub(super) const fn of_head(head: u8) -> Option<Self> {
        Self::new(head >> 1 & 0b111)
    }
}
