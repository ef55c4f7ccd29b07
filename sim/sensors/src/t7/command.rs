//! The T7's commands: codes and lengths.
//!
//! Source: "T7 Communication User Guide" 1.7, section 2 (the tables; where an example differs, the table
//! holds).

use super::frame;

/// Length byte of every Set answer.
const STATUS_LENGTH: u8 = 3;

/// Command codes (section 2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Command {
    GetAllAngles = 0x80,
    GetAngle0 = 0x81,
    GetAngle1 = 0x82,
    GetAngle2 = 0x83,
    SetAngle = 0x84,
    GetAllOffsets = 0x85,
    SetOffset = 0x86,
    GetAllData = 0x87,
    GetAllDirections = 0x88,
    SetDirection = 0x89,
    GetDamping = 0x8A,
    SetDamping = 0x8B,
    GetRange = 0x8C,
    SetRange = 0x8D,
    GetInformation = 0x8E,
    SetBaudRate = 0x8F,
    SetAddress = 0x91,
}

impl Command {
    pub fn from_code(code: u8) -> Option<Self> {
        Some(match code {
            0x80 => Self::GetAllAngles,
            0x81 => Self::GetAngle0,
            0x82 => Self::GetAngle1,
            0x83 => Self::GetAngle2,
            0x84 => Self::SetAngle,
            0x85 => Self::GetAllOffsets,
            0x86 => Self::SetOffset,
            0x87 => Self::GetAllData,
            0x88 => Self::GetAllDirections,
            0x89 => Self::SetDirection,
            0x8A => Self::GetDamping,
            0x8B => Self::SetDamping,
            0x8C => Self::GetRange,
            0x8D => Self::SetRange,
            0x8E => Self::GetInformation,
            0x8F => Self::SetBaudRate,
            0x91 => Self::SetAddress,
            _ => return None,
        })
    }

    /// Length byte of the command.
    pub fn length(self) -> usize {
        match self {
            Self::SetAngle | Self::SetOffset => 7,
            Self::SetDirection | Self::SetDamping => 4,
            Self::SetRange | Self::SetBaudRate => 3,
            Self::SetAddress => 8,
            _ => 1,
        }
    }

    /// Length byte of the answer.
    pub fn answer_length(self) -> u8 {
        match self {
            Self::GetAllAngles => 0x10,
            Self::GetAngle0 | Self::GetAngle1 | Self::GetAngle2 => 6,
            Self::GetAllOffsets => 0x0E,
            Self::GetAllData => 0x20,
            Self::GetAllDirections => 5,
            Self::GetDamping => 4,
            Self::GetRange => 3,
            Self::GetInformation => 0x14,
            _ => STATUS_LENGTH,
        }
    }

    /// Whether a message of this length can only be an answer.
    pub fn is_answer(self, length: usize) -> bool {
        length == usize::from(self.answer_length()) && length != self.length()
    }

    /// A Set command: it carries a checksum, is answered with a status, and may take longer.
    pub fn is_set(self) -> bool {
        self.length() > 1
    }
}

/// The answer with another status under a right checksum, if it is a Set command's answer.
pub(super) fn with_status(answer: &[u8], status: u8) -> Option<Vec<u8>> {
    match *answer {
        [address, STATUS_LENGTH, code, _, _] if Command::from_code(code)?.is_set() => {
            Some(frame::answer(address, code, &[status]))
        }
        _ => None,
    }
}
