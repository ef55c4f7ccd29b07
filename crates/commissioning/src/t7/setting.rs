//! The settings that are read, compared and written alike.

use clino_codec::angle::Range;
use clino_codec::t7::{Axis, Direction, Millidegrees, Request, Response};

/// A setting with its value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum DeviceSetting {
    /// What is added to an axis' absolute angle.
    Offset {
        /// Which axis.
        axis: Axis,
        /// In 0.001°, within the device's output range.
        offset: Millidegrees,
    },
    /// Counting direction of an axis.
    Direction {
        /// Which axis.
        axis: Axis,
        /// Which way.
        direction: Direction,
    },
    /// Averaging time in milliseconds, 2–5000.
    Damping(u16),
    /// Output range.
    Range(Range),
}

impl DeviceSetting {
    /// The axis that it is about, if it is about one.
    pub const fn axis(&self) -> Option<Axis> {
        match *self {
            Self::Offset { axis, .. } | Self::Direction { axis, .. } => Some(axis),
            Self::Damping(_) | Self::Range(_) => None,
        }
    }

    /// The request that reads it.
    pub const fn get(&self) -> Request {
        match self {
            Self::Offset { .. } => Request::GetAllAngleOffsets,
            Self::Direction { .. } => Request::GetAllDirections,
            Self::Damping(_) => Request::GetDamping,
            Self::Range(_) => Request::GetAngleOutputRange,
        }
    }

    /// The request that writes it.
    pub const fn set(&self) -> Request {
        match *self {
            Self::Offset { axis, offset } => Request::SetAngleOffset { axis, offset },
            Self::Direction { axis, direction } => Request::SetDirection { axis, direction },
            Self::Damping(damping_ms) => Request::SetDamping { damping_ms },
            Self::Range(range) => Request::SetAngleOutputRange(range),
        }
    }

    /// The same setting with the value in an answer to [`get`](Self::get); `None` if it answers something else.
    pub fn read(&self, response: &Response) -> Option<DeviceSetting> {
        Some(match (*self, *response) {
            (Self::Offset { axis, .. }, Response::GetAllAngleOffsets { offsets }) => {
                Self::Offset { axis, offset: axis.of(offsets) }
            }
            (Self::Direction { axis, .. }, Response::GetAllDirections { directions }) => {
                Self::Direction { axis, direction: axis.of(directions) }
            }
            (Self::Damping(_), Response::GetDamping { damping_ms }) => Self::Damping(damping_ms),
            (Self::Range(_), Response::GetAngleOutputRange(range)) => Self::Range(range),
            _ => return None,
        })
    }
}
