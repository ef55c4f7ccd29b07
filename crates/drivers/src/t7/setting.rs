//! Settings that a T7 keeps in non-volatile memory, which wears: read, compare, write only a difference, read back.

use clino_codec::angle::Range;
use clino_codec::t7::{Address, Axis, Direction, EncodeError, Field, Millidegrees, Request, Response};

use super::{Error, FlashWrite, question};

/// Millidegrees of a turn.
const TURN_MDEG: i32 = 360_000;

/// A setting and the value it is to have.
#[derive(Clone, Copy)]
pub(crate) enum Setting {
    Offset(Axis, Millidegrees),
    Direction(Axis, Direction),
    Damping(u16),
    Range(Range),
}

impl Setting {
    /// Whether the command that writes it can be sent at all.
    pub(crate) fn check(self, address: Address) -> Result<(), EncodeError> {
        self.write().encode(address).map(|_| ())
    }

    /// The axis that it is about, if not every T7 has it. A single-axis T7 answers zero for it, which may be the value wanted.
    pub(crate) fn axis_in_question(self) -> Option<Axis> {
        match self {
            Self::Offset(axis, _) | Self::Direction(axis, _) => Some(axis).filter(|&axis| axis != Axis::Two),
            Self::Damping(_) | Self::Range(_) => None,
        }
    }

    /// The command that reads it.
    pub(crate) const fn read(self) -> Request {
        match self {
            Self::Offset(..) => Request::GetAllAngleOffsets,
            Self::Direction(..) => Request::GetAllDirections,
            Self::Damping(_) => Request::GetDamping,
            Self::Range(_) => Request::GetAngleOutputRange,
        }
    }

    /// The command that writes it.
    pub(crate) const fn write(self) -> Request {
        match self {
            Self::Offset(axis, offset) => Request::SetAngleOffset { axis, offset },
            Self::Direction(axis, direction) => Request::SetDirection { axis, direction },
            Self::Damping(damping_ms) => Request::SetDamping { damping_ms },
            Self::Range(range) => Request::SetAngleOutputRange(range),
        }
    }

    /// Whether the device has this value, according to its answer.
    pub(crate) fn is_in<E>(self, address: Address, response: Response) -> Result<bool, Error<E>> {
        self.found(address, response).map(|found| self.same(found))
    }

    /// That the device has this value after it was written.
    pub(crate) fn was_kept<E>(self, address: Address, response: Response) -> Result<FlashWrite, Error<E>> {
        let found = self.found(address, response)?;
        match self.same(found) {
            true => Ok(FlashWrite::Written),
            false => Err(Error::NotKept { field: self.field(), written: self.wanted(), found }),
        }
    }

    fn same(self, found: i32) -> bool {
        match self {
            // Whole turns make no difference.
            Self::Offset(..) => found.rem_euclid(TURN_MDEG) == self.wanted().rem_euclid(TURN_MDEG),
            _ => found == self.wanted(),
        }
    }

    const fn field(self) -> Field {
        match self {
            Self::Offset(..) => Field::Offset,
            Self::Direction(..) => Field::Direction,
            Self::Damping(_) => Field::Damping,
            Self::Range(_) => Field::OutputRange,
        }
    }

    /// The value as a message carries it.
    fn wanted(self) -> i32 {
        match self {
            Self::Offset(_, offset) => offset.0,
            Self::Direction(_, direction) => i32::from(direction.get()),
            Self::Damping(damping_ms) => i32::from(damping_ms),
            Self::Range(range) => range_code(range),
        }
    }

    /// The value in the device's answer, likewise.
    fn found<E>(self, address: Address, response: Response) -> Result<i32, Error<E>> {
        Ok(match self {
            Self::Offset(axis, _) => axis.of(question::offsets(address, response)?).mdeg(),
            Self::Direction(axis, _) => i32::from(axis.of(question::directions(address, response)?).get()),
            Self::Damping(_) => i32::from(question::damping_ms(address, response)?),
            Self::Range(_) => range_code(question::range(address, response)?),
        })
    }
}

/// T7 guide section 2.6.
const fn range_code(range: Range) -> i32 {
    match range {
        Range::Bidirectional => 0,
        Range::Unidirectional => 1,
    }
}
