//! Command codes, and the length bytes that each message may have. Source: T7 guide §2.

use super::Axis;

/// A command code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(u8)]
pub enum Opcode {
    /// §2.1.1.
    GetAllAngles = 0x80,
    /// §2.1.2.
    GetAngle0 = 0x81,
    /// §2.1.3.
    GetAngle1 = 0x82,
    /// §2.1.4.
    GetAngle2 = 0x83,
    /// §2.1.5.
    SetAngle = 0x84,
    /// §2.2.1.
    GetAllAngleOffsets = 0x85,
    /// §2.2.2.
    SetAngleOffset = 0x86,
    /// §2.3.
    GetAllData = 0x87,
    /// §2.4.1.
    GetAllDirections = 0x88,
    /// §2.4.2.
    SetDirection = 0x89,
    /// §2.5.1.
    GetDamping = 0x8A,
    /// §2.5.2.
    SetDamping = 0x8B,
    /// §2.6.1.
    GetAngleOutputRange = 0x8C,
    /// §2.6.2.
    SetAngleOutputRange = 0x8D,
    /// §2.7.1.
    GetDeviceInformation = 0x8E,
    /// §2.7.2.
    SetBaudRate = 0x8F,
    /// §2.8.
    SetAddress = 0x91,
}

/// Length byte of every Get command: the command code alone.
pub(super) const GET_LENGTH: u8 = 0x01;
/// Length byte of every answer to a Set command: command, status, checksum.
const STATUS_LENGTH: u8 = 0x03;
/// Length byte of Get All Angles in the guide's printed example. Its table says 10, which fits the 16 bytes
/// that follow; the example's checksum was computed with 0A, so that some device may really send it. Source:
/// §2.1.1.
pub(super) const PRINTED_GET_ALL_ANGLES_LENGTH: u8 = 0x0A;
/// Largest response length value at which a command may go to the all-respond address. Source: §1.4.
const MAX_ALL_RESPOND_LENGTH: u8 = 8;

impl Opcode {
    /// All commands, by code.
    pub const ALL: [Self; 17] = [
        Self::GetAllAngles,
        Self::GetAngle0,
        Self::GetAngle1,
        Self::GetAngle2,
        Self::SetAngle,
        Self::GetAllAngleOffsets,
        Self::SetAngleOffset,
        Self::GetAllData,
        Self::GetAllDirections,
        Self::SetDirection,
        Self::GetDamping,
        Self::SetDamping,
        Self::GetAngleOutputRange,
        Self::SetAngleOutputRange,
        Self::GetDeviceInformation,
        Self::SetBaudRate,
        Self::SetAddress,
    ];

    /// The command of that code.
    pub const fn new(code: u8) -> Option<Self> {
        Some(match code {
            0x80 => Self::GetAllAngles,
            0x81 => Self::GetAngle0,
            0x82 => Self::GetAngle1,
            0x83 => Self::GetAngle2,
            0x84 => Self::SetAngle,
            0x85 => Self::GetAllAngleOffsets,
            0x86 => Self::SetAngleOffset,
            0x87 => Self::GetAllData,
            0x88 => Self::GetAllDirections,
            0x89 => Self::SetDirection,
            0x8A => Self::GetDamping,
            0x8B => Self::SetDamping,
            0x8C => Self::GetAngleOutputRange,
            0x8D => Self::SetAngleOutputRange,
            0x8E => Self::GetDeviceInformation,
            0x8F => Self::SetBaudRate,
            0x91 => Self::SetAddress,
            _ => return None,
        })
    }

    /// The code.
    pub const fn get(self) -> u8 {
        self as u8
    }

    /// Get Angle for that axis.
    pub const fn get_angle(axis: Axis) -> Self {
        match axis {
            Axis::Zero => Self::GetAngle0,
            Axis::One => Self::GetAngle1,
            Axis::Two => Self::GetAngle2,
        }
    }

    /// The axis of a Get Angle command; `None` for all others.
    pub const fn axis(self) -> Option<Axis> {
        match self {
            Self::GetAngle0 => Some(Axis::Zero),
            Self::GetAngle1 => Some(Axis::One),
            Self::GetAngle2 => Some(Axis::Two),
            _ => None,
        }
    }

    /// Whether the command changes the device; such changes land in memory that wears.
    pub const fn is_set(self) -> bool {
        self.request_length() != GET_LENGTH
    }

    /// Length byte of the command: what follows it, checksum (Set commands only) included.
    pub const fn request_length(self) -> u8 {
        match self {
            Self::SetAngle | Self::SetAngleOffset => 0x07,
            Self::SetDirection | Self::SetDamping => 0x04,
            Self::SetAngleOutputRange | Self::SetBaudRate => 0x03,
            Self::SetAddress => 0x08,
            _ => GET_LENGTH,
        }
    }

    /// Length byte of the answer: what follows it, checksum included.
    // In one place: its table would be in a program twice.
    #[inline(never)]
    pub const fn response_length(self) -> u8 {
        match self {
            Self::GetAllAngles => 0x10,
            Self::GetAngle0 | Self::GetAngle1 | Self::GetAngle2 => 0x06,
            Self::GetAllAngleOffsets => 0x0E,
            Self::GetAllData => 0x20,
            Self::GetAllDirections => 0x05,
            Self::GetDamping => 0x04,
            Self::GetAngleOutputRange => 0x03,
            Self::GetDeviceInformation => 0x14,
            _ => STATUS_LENGTH,
        }
    }

    /// Whether the command may be sent to [`Address::ALL`](super::Address::ALL): response length at most
    /// eight.
    ///
    /// By this rule of §1.4 Set Baud Rate and Set Address qualify, although the list that follows the rule
    /// does not name them.
    pub const fn may_go_to_all(self) -> bool {
        self.response_length() <= MAX_ALL_RESPOND_LENGTH
    }
}

/// Whether an answer to `opcode` may carry this length byte.
pub(super) fn length_fits(length: u8, opcode: Opcode) -> bool {
    length == opcode.response_length() || is_quirk(length, opcode)
}

/// Whether an answer to `opcode` with this length byte has it from the guide's printed example.
pub(super) fn is_quirk(length: u8, opcode: Opcode) -> bool {
    opcode == Opcode::GetAllAngles && length == PRINTED_GET_ALL_ANGLES_LENGTH
}
