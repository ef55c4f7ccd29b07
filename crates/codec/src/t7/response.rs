//! What devices answer. Source: T7 guide §1.2, §2.

use super::error::{DecodeError, Field};
use super::frame::Frame;
use super::request::{MAX_DAMPING_MS, MIN_DAMPING_MS, direction, range, range_code};
use super::{
    Acceleration, Answer, Axis, DeviceInformation, Direction, Millidegrees, Opcode, Status, Temperature,
};
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
}

/// Reads the body of an answer, whose length was checked, and checks numbers against their documented ranges.
/// Temperatures are reported as they are.
///
/// `whole` makes an answer of the response, arm by arm: a response of its own, made here and moved there,
/// costs more instructions than all the rest.
pub(super) fn parse(
    opcode: Opcode,
    mut body: Reader<'_>,
    values: ValueRange,
    whole: impl Fn(Response) -> Answer,
) -> Result<Answer, DecodeError> {
    use Response as R;
    let angle = Field::Angle;
    match opcode {
        Opcode::GetAngle0 | Opcode::GetAngle1 | Opcode::GetAngle2 => {
            let axis = opcode.axis().unwrap_or(Axis::Two);
            Ok(whole(R::GetAngle { axis, angle: number(&mut body, angle, values)? }))
        }
        Opcode::GetAllAngles => {
            let angles = triple(&mut body, angle, values)?;
            Ok(whole(R::GetAllAngles { angles, temperature: Temperature(body.i16()) }))
        }
        Opcode::GetAllAngleOffsets => {
            Ok(whole(R::GetAllAngleOffsets { offsets: triple(&mut body, Field::Offset, values)? }))
        }
        Opcode::GetAllData => {
            let angles = triple(&mut body, angle, values)?;
            let temperature = Temperature(body.i16());
            let accelerations = triple(&mut body, angle, ValueRange::Off)?.map(|raw| Acceleration(raw.0));
            Ok(whole(R::GetAllData { angles, temperature, accelerations, serial: body.u32() }))
        }
        Opcode::GetAllDirections => {
            let [zero, one, two] = body.array();
            let directions = [direction(zero)?, direction(one)?, direction(two)?];
            Ok(whole(R::GetAllDirections { directions }))
        }
        Opcode::GetDamping => Ok(whole(R::GetDamping { damping_ms: damping(body.u16(), values)? })),
        Opcode::GetAngleOutputRange => Ok(whole(R::GetAngleOutputRange(range(body.u8())?))),
        Opcode::GetDeviceInformation => Ok(whole(R::GetDeviceInformation(DeviceInformation {
            serial: body.u32(),
            firmware: Text::new(body.array()),
            product: Text::new(body.array()),
            calibration_state: body.u16(),
        }))),
        Opcode::SetAngle => Ok(whole(R::SetAngle(Status::new(body.u8())))),
        Opcode::SetAngleOffset => Ok(whole(R::SetAngleOffset(Status::new(body.u8())))),
        Opcode::SetDirection => Ok(whole(R::SetDirection(Status::new(body.u8())))),
        Opcode::SetDamping => Ok(whole(R::SetDamping(Status::new(body.u8())))),
        Opcode::SetAngleOutputRange => Ok(whole(R::SetAngleOutputRange(Status::new(body.u8())))),
        Opcode::SetBaudRate => Ok(whole(R::SetBaudRate(Status::new(body.u8())))),
        Opcode::SetAddress => Ok(whole(R::SetAddress(Status::new(body.u8())))),
    }
}

/// An angle or offset within the range that is asked for.
fn number(body: &mut Reader<'_>, field: Field, values: ValueRange) -> Result<Millidegrees, DecodeError> {
    let number = Millidegrees(body.i32());
    if values.allows(number) { Ok(number) } else { Err(DecodeError::Value { field, value: number.0 }) }
}

fn triple(body: &mut Reader<'_>, field: Field, values: ValueRange) -> Result<[Millidegrees; 3], DecodeError> {
    Ok([number(body, field, values)?, number(body, field, values)?, number(body, field, values)?])
}

fn damping(damping_ms: u16, values: ValueRange) -> Result<u16, DecodeError> {
    if values == ValueRange::Off || (MIN_DAMPING_MS..=MAX_DAMPING_MS).contains(&damping_ms) {
        Ok(damping_ms)
    } else {
        Err(DecodeError::Value { field: Field::Damping, value: i32::from(damping_ms) })
    }
}

fn write_triple(frame: &mut Frame, triple: [i32; 3]) {
    triple.iter().for_each(|value| frame.extend(&value.to_be_bytes()));
}
