//! Commands from the host to a device. Source: T7 guide §1.1, §2.
//!
//! Get commands are three bytes without a checksum; Set commands carry parameters and a checksum.

use super::envelope::{Envelope, Speaker};
use super::error::{DecodeError, EncodeError};
use super::frame::CommandFrame;
use super::opcode::GET_LENGTH;
use super::parameters::{direction, range, range_code};
use super::{Address, Axis, BaudRate, DeviceType, Direction, Expected, Millidegrees, Opcode, fields};
use crate::angle::Range;
use crate::bytes::{Reader, Writer};
use crate::checks::{Checks, ValueRange};

/// A command.
///
/// Set commands land in non-volatile memory, which wears: read first and write only what differs.
///
/// ```
/// use clino_codec::t7::{Address, Axis, Millidegrees, Request};
///
/// let request = Request::SetAngle { axis: Axis::Two, angle: Millidegrees(10_500) };
/// let frame = request.encode(Address::new(5).unwrap()).unwrap();
/// assert_eq!(frame.as_bytes(), [0x05, 0x07, 0x84, 0x02, 0x00, 0x00, 0x29, 0x04, 0x41]);
///
/// let heard = Request::decode(frame.as_bytes()).unwrap();
/// assert_eq!(heard.request, request);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Request {
    /// 80: all angles and the temperature.
    GetAllAngles,
    /// 81, 82, 83: the angle of one axis.
    GetAngle(Axis),
    /// 84: chooses the offset so that the angle now is this one. Wait out the damping time first.
    SetAngle {
        /// Which axis.
        axis: Axis,
        /// Its new angle, −180.000°…359.999°; the device further narrows that to its output mode.
        angle: Millidegrees,
    },
    /// 85: all angle offsets.
    GetAllAngleOffsets,
    /// 86: sets the offset that the device adds to its absolute angle.
    SetAngleOffset {
        /// Which axis.
        axis: Axis,
        /// Its new offset, −180.000°…359.999°; the device further narrows that to its output mode.
        offset: Millidegrees,
    },
    /// 87: angles, temperature, accelerations, serial number.
    GetAllData,
    /// 88: the directions of all axes.
    GetAllDirections,
    /// 89: sets the counting direction of one axis.
    SetDirection {
        /// Which axis.
        axis: Axis,
        /// Its new direction.
        direction: Direction,
    },
    /// 8A: the damping time.
    GetDamping,
    /// 8B: sets the damping time.
    SetDamping {
        /// Averaging time in milliseconds,
        /// [`MIN_DAMPING_MS`](super::MIN_DAMPING_MS)…[`MAX_DAMPING_MS`](super::MAX_DAMPING_MS).
        damping_ms: u16,
    },
    /// 8C: the output range.
    GetAngleOutputRange,
    /// 8D: sets the output range.
    SetAngleOutputRange(Range),
    /// 8E: serial number, firmware version, product type.
    GetDeviceInformation,
    /// 8F: sets the baud rate. The answer comes at the old rate; the device changes about 10 ms later.
    SetBaudRate(BaudRate),
    /// 91: gives the device of that type and serial number a new address. The answer carries the old one.
    SetAddress {
        /// Kind of device.
        device_type: DeviceType,
        /// Serial number of the device that is meant.
        serial: u32,
        /// 1–100. The factory address 127 cannot be given.
        new_address: Address,
    },
}

/// A command and its addressee.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Command {
    /// The device, or [`Address::ALL`].
    pub address: Address,
    /// What it is asked.
    pub request: Request,
}

impl Request {
    /// The command code.
    #[inline(always)]
    pub const fn opcode(&self) -> Opcode {
        match self {
            Self::GetAllAngles => Opcode::GetAllAngles,
            Self::GetAngle(axis) => Opcode::get_angle(*axis),
            Self::SetAngle { .. } => Opcode::SetAngle,
            Self::GetAllAngleOffsets => Opcode::GetAllAngleOffsets,
            Self::SetAngleOffset { .. } => Opcode::SetAngleOffset,
            Self::GetAllData => Opcode::GetAllData,
            Self::GetAllDirections => Opcode::GetAllDirections,
            Self::SetDirection { .. } => Opcode::SetDirection,
            Self::GetDamping => Opcode::GetDamping,
            Self::SetDamping { .. } => Opcode::SetDamping,
            Self::GetAngleOutputRange => Opcode::GetAngleOutputRange,
            Self::SetAngleOutputRange(_) => Opcode::SetAngleOutputRange,
            Self::GetDeviceInformation => Opcode::GetDeviceInformation,
            Self::SetBaudRate(_) => Opcode::SetBaudRate,
            Self::SetAddress { .. } => Opcode::SetAddress,
        }
    }

    /// Whether it changes the device: see [`Opcode::is_set`].
    #[inline]
    pub const fn is_set(&self) -> bool {
        !matches!(
            self,
            Self::GetAllAngles
                | Self::GetAngle(_)
                | Self::GetAllAngleOffsets
                | Self::GetAllData
                | Self::GetAllDirections
                | Self::GetDamping
                | Self::GetAngleOutputRange
                | Self::GetDeviceInformation
        )
    }

    /// What the answer to this command, sent to `address`, has to be.
    pub const fn expected(&self, address: Address) -> Expected {
        Expected { address, opcode: self.opcode() }
    }

    /// The command as it goes over the line.
    ///
    /// # Errors
    /// [`EncodeError::OutOfRange`] for a parameter beyond its documented limits, which are in the error;
    /// [`EncodeError::NotForAll`] for a command that must not go to the all-respond address.
    pub fn encode(&self, address: Address) -> Result<CommandFrame, EncodeError> {
        let opcode = self.opcode();
        if address.is_all() && !opcode.may_go_to_all() {
            return Err(EncodeError::NotForAll { opcode, response_length: opcode.response_length() });
        }
        let length = if self.is_set() { opcode.request_length() } else { GET_LENGTH };
        let mut frame = CommandFrame::new(address, length, opcode.get());
        if self.is_set() {
            self.write(Writer::new(frame.body()));
            fields::check(opcode, frame.body(), ValueRange::AnyMode)?;
            frame.seal();
        }
        Ok(frame)
    }

    /// Writes the parameters of a Set command; a Get command has none, and no checksum.
    #[inline(always)]
    fn write(&self, mut body: Writer<'_>) {
        match *self {
            Self::SetAngle { axis, angle: value } | Self::SetAngleOffset { axis, offset: value } => {
                body.put([axis.get()]);
                body.put(value.0.to_be_bytes());
            }
            Self::SetDirection { axis, direction } => body.put([axis.get(), direction.get()]),
            Self::SetDamping { damping_ms } => body.put(damping_ms.to_be_bytes()),
            Self::SetAngleOutputRange(range) => body.put([range_code(range)]),
            Self::SetBaudRate(rate) => body.put([rate.get()]),
            Self::SetAddress { device_type, serial, new_address } => {
                body.put([device_type.get()]);
                body.put(serial.to_be_bytes());
                body.put([new_address.get()]);
            }
            Self::GetAllAngles
            | Self::GetAngle(_)
            | Self::GetAllAngleOffsets
            | Self::GetAllData
            | Self::GetAllDirections
            | Self::GetDamping
            | Self::GetAngleOutputRange
            | Self::GetDeviceInformation => {}
        }
    }

    /// The command that these bytes are, whole and exactly. A command that must not go to the all-respond
    /// address is understood even there: a device, or a listener, may well hear it.
    ///
    /// # Errors
    /// Whatever is wrong with them. [`DecodeError::Value`] is what a device answers with
    /// [`Status::InvalidParameter`](super::Status::InvalidParameter).
    pub fn decode(bytes: &[u8]) -> Result<Command, DecodeError> {
        let Envelope { address, opcode, body, .. } = Envelope::open(bytes, Speaker::Host, Checks::ALL)?;
        if opcode.is_set() {
            fields::check(opcode, body, ValueRange::AnyMode)?;
        }
        Ok(Command { address, request: Self::read(opcode, Reader::new(body)) })
    }

    /// Reads the parameters of a command, whose length and [fields] were checked.
    #[inline(always)]
    fn read(opcode: Opcode, mut body: Reader<'_>) -> Self {
        match opcode {
            Opcode::GetAllAngles => Self::GetAllAngles,
            Opcode::GetAngle0 => Self::GetAngle(Axis::Zero),
            Opcode::GetAngle1 => Self::GetAngle(Axis::One),
            Opcode::GetAngle2 => Self::GetAngle(Axis::Two),
            Opcode::SetAngle => Self::SetAngle { axis: axis(body.u8()), angle: Millidegrees(body.i32()) },
            Opcode::GetAllAngleOffsets => Self::GetAllAngleOffsets,
            Opcode::SetAngleOffset => {
                Self::SetAngleOffset { axis: axis(body.u8()), offset: Millidegrees(body.i32()) }
            }
            Opcode::GetAllData => Self::GetAllData,
            Opcode::GetAllDirections => Self::GetAllDirections,
            Opcode::SetDirection => {
                Self::SetDirection { axis: axis(body.u8()), direction: direction(body.u8()) }
            }
            Opcode::GetDamping => Self::GetDamping,
            Opcode::SetDamping => Self::SetDamping { damping_ms: body.u16() },
            Opcode::GetAngleOutputRange => Self::GetAngleOutputRange,
            Opcode::SetAngleOutputRange => Self::SetAngleOutputRange(range(body.u8())),
            Opcode::GetDeviceInformation => Self::GetDeviceInformation,
            Opcode::SetBaudRate => Self::SetBaudRate(BaudRate::new(body.u8()).unwrap_or(BaudRate::B9600)),
            Opcode::SetAddress => Self::SetAddress {
                device_type: DeviceType::new(body.u8()).unwrap_or(DeviceType::T7_1),
                serial: body.u32(),
                new_address: Address::new(body.u8()).unwrap_or(Address::FACTORY),
            },
        }
    }
}

/// The axis of a number that was checked.
const fn axis(number: u8) -> Axis {
    match number {
        0 => Axis::Zero,
        1 => Axis::One,
        _ => Axis::Two,
    }
}
