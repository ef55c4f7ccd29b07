//! Which numbers of a message have limits, where they stand, and what the limits are. Source: T7 guide §2.

use super::error::{DecodeError, EncodeError, Field};
use super::parameters::{MAX_DAMPING_MS, MIN_DAMPING_MS};
use super::{Address, Axis, BaudRate, DeviceType, Opcode};
use crate::checks::ValueRange;

/// Lowest command code.
const FIRST: u8 = Opcode::GetAllAngles.get();
/// Most fields of one message.
const MOST: usize = 3;
/// Place of a field, counted from the byte after the command code.
type Place = Option<(Field, u8)>;

/// The fields of each message, by command code: of the command itself if it is a Set command, of the answer if
/// it is a Get command. Nothing in the other direction has limits.
const FIELDS: [[Place; MOST]; 18] = [
    /* 80 */ [Some((Field::Angle, 0)), Some((Field::Angle, 4)), Some((Field::Angle, 8))],
    /* 81 */ [Some((Field::Angle, 0)), None, None],
    /* 82 */ [Some((Field::Angle, 0)), None, None],
    /* 83 */ [Some((Field::Angle, 0)), None, None],
    /* 84 */ [Some((Field::Axis, 0)), Some((Field::Angle, 1)), None],
    /* 85 */ [Some((Field::Offset, 0)), Some((Field::Offset, 4)), Some((Field::Offset, 8))],
    /* 86 */ [Some((Field::Axis, 0)), Some((Field::Offset, 1)), None],
    /* 87 */ [Some((Field::Angle, 0)), Some((Field::Angle, 4)), Some((Field::Angle, 8))],
    /* 88 */ [Some((Field::Direction, 0)), Some((Field::Direction, 1)), Some((Field::Direction, 2))],
    /* 89 */ [Some((Field::Axis, 0)), Some((Field::Direction, 1)), None],
    /* 8A */ [Some((Field::Damping, 0)), None, None],
    /* 8B */ [Some((Field::Damping, 0)), None, None],
    /* 8C */ [Some((Field::OutputRange, 0)), None, None],
    /* 8D */ [Some((Field::OutputRange, 0)), None, None],
    /* 8E */ [None, None, None],
    /* 8F */ [Some((Field::BaudRate, 0)), None, None],
    /* 90 */ [None, None, None],
    /* 91 */ [Some((Field::DeviceType, 0)), Some((Field::NewAddress, 5)), None],
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
    let fields = FIELDS.get(usize::from(opcode.get().wrapping_sub(FIRST))).unwrap_or(&[None; MOST]);
    for &(field, at) in fields.iter().flatten() {
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
