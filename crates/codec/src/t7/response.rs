//! What devices answer. Source: T7 guide §1.2, §2.

use super::error::{DecodeError, Field};
use super::frame::Frame;
use super::request::{MAX_DAMPING_MS, MIN_DAMPING_MS, direction, range, range_code};
use super::{Acceleration, Answer, Axis, DeviceInformation, Direction, Millidegrees, Opcode, Status, Temperature};
use super::{Address, Text};
use crate::angle::Range;
use crate::bytes::Reader;
use crate::layers::ValueRange;

/// The content of an answer, named like the command it answers.
///
/// Angles and offsets are as sent. With the value check on they are within the documented range, and
/// [`Millidegrees::angle`] is never `None`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Response {
    /// 80.
    GetAllAngles {
        /// By axis.
        angles: [Millidegrees; 3],
        /// Of the device.
        temperature: Temperature,
    },
    /// 81, 82, 83.
    GetAngle {
        /// Which axis.
        axis: Axis,
        /// Its angle.
        angle: Millidegrees,
    },
    /// 84.
    SetAngle(Status),
    /// 85.
    GetAllAngleOffsets {
        /// By axis.
        offsets: [Millidegrees; 3],
    },
    /// 86.
    SetAngleOffset(Status),
    /// 87.
    GetAllData {
        /// By axis.
        angles: [Millidegrees; 3],
        /// Of the device.
        temperature: Temperature,
        /// By axis.
        accelerations: [Acceleration; 3],
        /// Serial number.
        serial: u32,
    },
    /// 88.
    GetAllDirections {
        /// By axis.
        directions: [Direction; 3],
    },
    /// 89.
    SetDirection(Status),
    /// 8A.
    GetDamping {
        /// Averaging time in milliseconds.
        damping_ms: u16,
    },
    /// 8B.
    SetDamping(Status),
    /// 8C.
    GetAngleOutputRange(Range),
    /// 8D.
    SetAngleOutputRange(Status),
    /// 8E.
    GetDeviceInformation(DeviceInformation),
    /// 8F.
    SetBaudRate(Status),
    /// 91. The answer carries the old address.
    SetAddress(Status),
}

impl Response {
    /// The command that is answered.
    pub const fn opcode(&self) -> Opcode {
        match self {
            Self::GetAllAngles { .. } => Opcode::GetAllAngles,
            Self::GetAngle { axis, .. } => Opcode::get_angle(*axis),
            Self::SetAngle(_) => Opcode::SetAngle,
            Self::GetAllAngleOffsets { .. } => Opcode::GetAllAngleOffsets,
            Self::SetAngleOffset(_) => Opcode::SetAngleOffset,
            Self::GetAllData { .. } => Opcode::GetAllData,
            Self::GetAllDirections { .. } => Opcode::GetAllDirections,
            Self::SetDirection(_) => Opcode::SetDirection,
            Self::GetDamping { .. } => Opcode::GetDamping,
            Self::SetDamping(_) => Opcode::SetDamping,
            Self::GetAngleOutputRange(_) => Opcode::GetAngleOutputRange,
            Self::SetAngleOutputRange(_) => Opcode::SetAngleOutputRange,
            Self::GetDeviceInformation(_) => Opcode::GetDeviceInformation,
            Self::SetBaudRate(_) => Opcode::SetBaudRate,
            Self::SetAddress(_) => Opcode::SetAddress,
        }
    }

    /// Outcome of a Set command; `None` for an answer to a Get command.
    pub const fn status(&self) -> Option<Status> {
        match self {
            Self::SetAngle(status)
            | Self::SetAngleOffset(status)
            | Self::SetDirection(status)
            | Self::SetDamping(status)
            | Self::SetAngleOutputRange(status)
            | Self::SetBaudRate(status)
            | Self::SetAddress(status) => Some(*status),
            _ => None,
        }
    }

    /// The answer as a device with that address sends it.
    pub fn encode(&self, address: Address) -> Frame {
        Answer { address, response: *self, length_quirk: false }.encode()
    }

    pub(super) fn write(&self, frame: &mut Frame) {
        match self {
            Self::GetAllAngles { angles, temperature } => {
                write_triple(frame, angles.map(|angle| angle.0));
                frame.extend(&temperature.0.to_be_bytes());
            }
            Self::GetAngle { angle, .. } => frame.extend(&angle.0.to_be_bytes()),
            Self::GetAllAngleOffsets { offsets } => write_triple(frame, offsets.map(|offset| offset.0)),
            Self::GetAllData { angles, temperature, accelerations, serial } => {
                write_triple(frame, angles.map(|angle| angle.0));
                frame.extend(&temperature.0.to_be_bytes());
                write_triple(frame, accelerations.map(|acceleration| acceleration.0));
                frame.extend(&serial.to_be_bytes());
            }
            Self::GetAllDirections { directions } => frame.extend(&directions.map(Direction::get)),
            Self::GetDamping { damping_ms } => frame.extend(&damping_ms.to_be_bytes()),
            Self::GetAngleOutputRange(range) => frame.extend(&[range_code(*range)]),
            Self::GetDeviceInformation(information) => {
                frame.extend(&information.serial.to_be_bytes());
                frame.extend(information.firmware.as_bytes());
                frame.extend(information.product.as_bytes());
                frame.extend(&information.calibration_state.to_be_bytes());
            }
            Self::SetAngle(status)
            | Self::SetAngleOffset(status)
            | Self::SetDirection(status)
            | Self::SetDamping(status)
            | Self::SetAngleOutputRange(status)
            | Self::SetBaudRate(status)
            | Self::SetAddress(status) => frame.extend(&[status.get()]),
        }
    }

    pub(super) fn parse(opcode: Opcode, mut body: Reader<'_>) -> Result<Self, DecodeError> {
        Ok(match opcode {
            Opcode::GetAllAngles => {
                Self::GetAllAngles { angles: angles(&mut body), temperature: Temperature(body.i16()) }
            }
            Opcode::GetAngle0 => Self::GetAngle { axis: Axis::Zero, angle: Millidegrees(body.i32()) },
            Opcode::GetAngle1 => Self::GetAngle { axis: Axis::One, angle: Millidegrees(body.i32()) },
            Opcode::GetAngle2 => Self::GetAngle { axis: Axis::Two, angle: Millidegrees(body.i32()) },
            Opcode::SetAngle => Self::SetAngle(Status::new(body.u8())),
            Opcode::GetAllAngleOffsets => Self::GetAllAngleOffsets { offsets: angles(&mut body) },
            Opcode::SetAngleOffset => Self::SetAngleOffset(Status::new(body.u8())),
            Opcode::GetAllData => Self::GetAllData {
                angles: angles(&mut body),
                temperature: Temperature(body.i16()),
                accelerations: angles(&mut body).map(|raw| Acceleration(raw.0)),
                serial: body.u32(),
            },
            Opcode::GetAllDirections => {
                let [zero, one, two] = body.array();
                Self::GetAllDirections { directions: [direction(zero)?, direction(one)?, direction(two)?] }
            }
            Opcode::SetDirection => Self::SetDirection(Status::new(body.u8())),
            Opcode::GetDamping => Self::GetDamping { damping_ms: body.u16() },
            Opcode::SetDamping => Self::SetDamping(Status::new(body.u8())),
            Opcode::GetAngleOutputRange => Self::GetAngleOutputRange(range(body.u8())?),
            Opcode::SetAngleOutputRange => Self::SetAngleOutputRange(Status::new(body.u8())),
            Opcode::GetDeviceInformation => Self::GetDeviceInformation(DeviceInformation {
                serial: body.u32(),
                firmware: Text::new(body.array()),
                product: Text::new(body.array()),
                calibration_state: body.u16(),
            }),
            Opcode::SetBaudRate => Self::SetBaudRate(Status::new(body.u8())),
            Opcode::SetAddress => Self::SetAddress(Status::new(body.u8())),
        })
    }

    /// Checks numbers against their documented ranges. Temperatures are reported as they are.
    pub(super) fn check(&self, range: ValueRange) -> Result<(), DecodeError> {
        let allowed = |value: &Millidegrees| match range {
            ValueRange::Off => true,
            ValueRange::AnyMode => value.is_in_any(),
            ValueRange::Mode(mode) => value.is_in(mode),
        };
        let (field, values) = match self {
            Self::GetAngle { angle, .. } => (Field::Angle, core::slice::from_ref(angle)),
            Self::GetAllAngles { angles, .. } | Self::GetAllData { angles, .. } => {
                (Field::Angle, angles.as_slice())
            }
            Self::GetAllAngleOffsets { offsets } => (Field::Offset, offsets.as_slice()),
            Self::GetDamping { damping_ms }
                if range != ValueRange::Off && !(MIN_DAMPING_MS..=MAX_DAMPING_MS).contains(damping_ms) =>
            {
                return Err(DecodeError::Value { field: Field::Damping, value: i32::from(*damping_ms) });
            }
            _ => return Ok(()),
        };
        match values.iter().find(|value| !allowed(value)) {
            Some(value) => Err(DecodeError::Value { field, value: value.0 }),
            None => Ok(()),
        }
    }
}

fn angles(body: &mut Reader<'_>) -> [Millidegrees; 3] {
    [Millidegrees(body.i32()), Millidegrees(body.i32()), Millidegrees(body.i32())]
}

fn write_triple(frame: &mut Frame, triple: [i32; 3]) {
    triple.iter().for_each(|value| frame.extend(&value.to_be_bytes()));
}
