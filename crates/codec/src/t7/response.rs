//! Answers of devices. Source: T7 guide §1.2, §2.

use super::frame::AnswerFrame;
use super::parameters::{direction, range, range_code};
use super::{Acceleration, Axis, DeviceInformation, Direction, Millidegrees, Opcode, Status, Temperature};
use super::{Address, Text};
use crate::angle::Range;
use crate::bytes::{Reader, Writer};

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
    pub fn encode(&self, address: Address) -> AnswerFrame {
        let opcode = self.opcode();
        let mut frame = AnswerFrame::new(address, opcode.response_length(), opcode.get());
        self.write(Writer::new(frame.body()));
        frame.seal();
        frame
    }

    #[inline(always)]
    fn write(&self, mut body: Writer<'_>) {
        match self {
            Self::GetAllAngles { angles, temperature } => {
                put_triple(&mut body, angles.map(|angle| angle.0));
                body.put(temperature.0.to_be_bytes());
            }
            Self::GetAngle { angle, .. } => body.put(angle.0.to_be_bytes()),
            Self::GetAllAngleOffsets { offsets } => {
                put_triple(&mut body, offsets.map(|offset| offset.0));
            }
            Self::GetAllData { angles, temperature, accelerations, serial } => {
                put_triple(&mut body, angles.map(|angle| angle.0));
                body.put(temperature.0.to_be_bytes());
                put_triple(&mut body, accelerations.map(|acceleration| acceleration.0));
                body.put(serial.to_be_bytes());
            }
            Self::GetAllDirections { directions } => body.put(directions.map(Direction::get)),
            Self::GetDamping { damping_ms } => body.put(damping_ms.to_be_bytes()),
            Self::GetAngleOutputRange(range) => body.put([range_code(*range)]),
            Self::GetDeviceInformation(information) => {
                body.put(information.serial.to_be_bytes());
                body.put(*information.firmware.as_bytes());
                body.put(*information.product.as_bytes());
                body.put(information.calibration_state.to_be_bytes());
            }
            Self::SetAngle(status)
            | Self::SetAngleOffset(status)
            | Self::SetDirection(status)
            | Self::SetDamping(status)
            | Self::SetAngleOutputRange(status)
            | Self::SetBaudRate(status)
            | Self::SetAddress(status) => body.put([status.get()]),
        }
    }

    /// Reads the body of an answer, whose length and [fields](super::fields) were checked. Temperatures and
    /// accelerations are reported as they are.
    pub(super) fn read(opcode: Opcode, body: &[u8]) -> Self {
        let (mut start, mut rest) = (Reader::new(body), Reader::new(body));
        // Every answer with angles or offsets begins with them; behind a shorter one zeros are read.
        let words = [rest.i32(), rest.i32(), rest.i32()].map(Millidegrees);
        let status = Status::new(body.first().copied().unwrap_or(0));
        match opcode {
            Opcode::GetAngle0 | Opcode::GetAngle1 | Opcode::GetAngle2 => {
                let (axis, [angle, ..]) = (opcode.axis().unwrap_or(Axis::Two), words);
                Self::GetAngle { axis, angle }
            }
            Opcode::GetAllAngles => {
                Self::GetAllAngles { angles: words, temperature: Temperature(rest.i16()) }
            }
            Opcode::GetAllAngleOffsets => Self::GetAllAngleOffsets { offsets: words },
            Opcode::GetAllData => Self::GetAllData {
                angles: words,
                temperature: Temperature(rest.i16()),
                accelerations: [rest.i32(), rest.i32(), rest.i32()].map(Acceleration),
                serial: rest.u32(),
            },
            Opcode::GetAllDirections => {
                Self::GetAllDirections { directions: start.array::<3>().map(direction) }
            }
            Opcode::GetDamping => Self::GetDamping { damping_ms: start.u16() },
            Opcode::GetAngleOutputRange => Self::GetAngleOutputRange(range(start.u8())),
            Opcode::GetDeviceInformation => Self::GetDeviceInformation(DeviceInformation {
                serial: start.u32(),
                firmware: Text::new(start.array()),
                product: Text::new(start.array()),
                calibration_state: start.u16(),
            }),
            Opcode::SetAngle => Self::SetAngle(status),
            Opcode::SetAngleOffset => Self::SetAngleOffset(status),
            Opcode::SetDirection => Self::SetDirection(status),
            Opcode::SetDamping => Self::SetDamping(status),
            Opcode::SetAngleOutputRange => Self::SetAngleOutputRange(status),
            Opcode::SetBaudRate => Self::SetBaudRate(status),
            Opcode::SetAddress => Self::SetAddress(status),
        }
    }
}

#[inline(always)]
fn put_triple(body: &mut Writer<'_>, [zero, one, two]: [i32; 3]) {
    body.put(zero.to_be_bytes());
    body.put(one.to_be_bytes());
    body.put(two.to_be_bytes());
}
