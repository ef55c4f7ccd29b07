//! Which numbers of a message have limits, where they stand, and what the limits are. Source: T7 guide §2.

use super::error::{DecodeError, EncodeError, Field};
use super::parameters::{MAX_DAMPING_MS, MIN_DAMPING_MS};
use super::{Address, Axis, BaudRate, DeviceType, Opcode};
use crate::checks::ValueRange;

/// The fields that have limits, and their places, counted from the byte after the command code: of a Set command, or of the
/// answer to a Get command. Nothing in the other direction has limits.
const FIELDS: [(Opcode, Field, u8); 28] = [
    (Opcode::GetAllAngles, Field::Angle, 0),
    (Opcode::GetAllAngles, Field::Angle, 4),
    (Opcode::GetAllAngles, Field::Angle, 8),
    (Opcode::GetAngle0, Field::Angle, 0),
    (Opcode::GetAngle1, Field::Angle, 0),
    (Opcode::GetAngle2, Field::Angle, 0),
    (Opcode::SetAngle, Field::Axis, 0),
    (Opcode::SetAngle, Field::Angle, 1),
    (Opcode::GetAllAngleOffsets, Field::Offset, 0),
    (Opcode::GetAllAngleOffsets, Field::Offset, 4),
    (Opcode::GetAllAngleOffsets, Field::Offset, 8),
    (Opcode::SetAngleOffset, Field::Axis, 0),
    (Opcode::SetAngleOffset, Field::Offset, 1),
    (Opcode::GetAllData, Field::Angle, 0),
    (Opcode::GetAllData, Field::Angle, 4),
    (Opcode::GetAllData, Field::Angle, 8),
    (Opcode::GetAllDirections, Field::Direction, 0),
    (Opcode::GetAllDirections, Field::Direction, 1),
    (Opcode::GetAllDirections, Field::Direction, 2),
    (Opcode::SetDirection, Field::Axis, 0),
    (Opcode::SetDirection, Field::Direction, 1),
    (Opcode::GetDamping, Field::Damping, 0),
    (Opcode::SetDamping, Field::Damping, 0),
    (Opcode::GetAngleOutputRange, Field::OutputRange, 0),
    (Opcode::SetAngleOutputRange, Field::OutputRange, 0),
    (Opcode::SetBaudRate, Field::BaudRate, 0),
    (Opcode::SetAddress, Field::DeviceType, 0),
    (Opcode::SetAddress, Field::NewAddress, 5),
];

impl Field {
    /// Lowest and highest value.
    const fn limits(self, values: ValueRange) -> (i32, i32) {
        match self {
            Self::Angle | Self::Offset => values.limits(),
            Self::Damping if matches!(values, ValueRange::Off) => (0, i32::MAX),
            Self::Damping => (MIN_DAMPING_MS as i32, MAX_DAMPING_MS as i32),
            Self::Axis => (Axis::Zero as i32, Axis::Two as i32),
            Self::Direction | Self::OutputRange => (0, 1),
            Self::BaudRate => (BaudRate::B115200 as i32, BaudRate::B9600 as i32),
            Self::DeviceType => (DeviceType::T7_3 as i32, DeviceType::T7_1 as i32),
            Self::NewAddress => (1, Address::LAST_ASSIGNABLE as i32),
        }
    }

    /// Bytes.
    const fn width(self) -> usize {
        match self {
            Self::Angle | Self::Offset => 4,
            Self::Damping => 2,
            _ => 1,
        }
    }
}

/// A number beyond its limits.
pub(super) struct OutOfRange {
    pub(super) field: Field,
    pub(super) value: i32,
    min: i32,
    max: i32,
}

/// Checks the limits in the body of a message that has such. Codes are always checked, numbers as `values` says.
#[inline(never)]
pub(super) fn check(opcode: Opcode, body: &[u8], values: ValueRange) -> Result<(), OutOfRange> {
    for &(_, field, at) in FIELDS.iter().filter(|&&(of, ..)| of == opcode) {
        let bytes = body.iter().skip(usize::from(at)).take(field.width());
        let value = bytes.fold(0, |value, &byte| value << 8 | i32::from(byte));
        let (min, max) = field.limits(values);
        // The codes between the two device types are not taken.
        let taken = field != Field::DeviceType || value == min || value == max;
        if value < min || value > max || !taken {
            return Err(OutOfRange { field, value, min, max });
        }
    }
    Ok(())
}

impl From<OutOfRange> for EncodeError {
    fn from(OutOfRange { field, value, min, max }: OutOfRange) -> Self {
        Self::OutOfRange { field, value, min, max }
    }
}

impl From<OutOfRange> for DecodeError {
    fn from(OutOfRange { field, value, .. }: OutOfRange) -> Self {
        Self::Value { field, value }
    }
}
