//! Commands from the host to a device. Source: T7 guide §1.1, §2.
//!
//! Get commands are three bytes without a checksum; Set commands carry parameters and a checksum.

use super::error::{DecodeError, EncodeError, Field};
use super::frame::{Frame, OVERHEAD};
use super::{Address, Axis, BaudRate, DeviceType, Direction, Expected, Millidegrees, Opcode};
use crate::angle::Range;
use crate::bytes::{Reader, sum};

/// Shortest damping time in milliseconds. Source: §2.5.2.
pub const MIN_DAMPING_MS: u16 = 2;
/// Longest damping time in milliseconds. Source: §2.5.2.
pub const MAX_DAMPING_MS: u16 = 5_000;
/// Highest address that can be given to a device. Source: §2.8.
const MAX_NEW_ADDRESS: i32 = 100;
/// Shortest command: address, length, command code.
const SHORTEST: usize = 3;

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
        /// Averaging time in milliseconds, [`MIN_DAMPING_MS`]…[`MAX_DAMPING_MS`].
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

/// A command and whom it is for.
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

    /// What the answer to this command, sent to `address`, has to be.
    pub const fn expected(&self, address: Address) -> Expected {
        Expected { address, opcode: self.opcode() }
    }

    /// The command as it goes over the line.
    ///
    /// # Errors
    /// [`EncodeError::OutOfRange`] for a parameter beyond its documented limits, which are in the error;
    /// [`EncodeError::NotForAll`] for a command that must not go to the all-respond address.
    pub fn encode(&self, address: Address) -> Result<Frame, EncodeError> {
        let opcode = self.opcode();
        if address.is_all() && !opcode.may_go_to_all() {
            return Err(EncodeError::NotForAll { opcode, response_length: opcode.response_length() });
        }
        self.check()?;
        let mut frame = Frame::start(address, opcode.request_length(), opcode.get());
        match *self {
            Self::SetAngle { axis, angle: value } | Self::SetAngleOffset { axis, offset: value } => {
                frame.extend(&[axis.get()]);
                frame.extend(&value.0.to_be_bytes());
            }
            Self::SetDirection { axis, direction } => frame.extend(&[axis.get(), direction.get()]),
            Self::SetDamping { damping_ms } => frame.extend(&damping_ms.to_be_bytes()),
            Self::SetAngleOutputRange(range) => frame.extend(&[range_code(range)]),
            Self::SetBaudRate(rate) => frame.extend(&[rate.get()]),
            Self::SetAddress { device_type, serial, new_address } => {
                frame.extend(&[device_type.get()]);
                frame.extend(&serial.to_be_bytes());
                frame.extend(&[new_address.get()]);
            }
            Self::GetAllAngles
            | Self::GetAngle(_)
            | Self::GetAllAngleOffsets
            | Self::GetAllData
            | Self::GetAllDirections
            | Self::GetDamping
            | Self::GetAngleOutputRange
            | Self::GetDeviceInformation => return Ok(frame),
        }
        Ok(frame.seal())
    }

    /// The command that these bytes are, whole and exactly. A command that must not go to the all-respond
    /// address is understood even there: a device, or a listener, may well hear it.
    ///
    /// # Errors
    /// Whatever is wrong with them. [`DecodeError::Value`] is what a device answers with
    /// [`Status::InvalidParameter`](super::Status::InvalidParameter).
    pub fn decode(bytes: &[u8]) -> Result<Command, DecodeError> {
        let [address, length, code, body @ ..] = bytes else {
            return Err(DecodeError::Size { received: bytes.len(), expected: SHORTEST });
        };
        let opcode = Opcode::new(*code).ok_or(DecodeError::UnknownCommand { command: *code })?;
        let address =
            Address::of_request(*address).ok_or(DecodeError::UnknownAddress { address: *address })?;
        let expected = opcode.request_length();
        if *length != expected {
            return Err(DecodeError::Length { received: *length, expected });
        }
        let expected = usize::from(expected).saturating_add(OVERHEAD);
        if bytes.len() != expected {
            return Err(DecodeError::Size { received: bytes.len(), expected });
        }
        let total = if opcode.is_set() { sum(bytes) } else { 0 };
        if total != 0 {
            let received = bytes.last().copied().unwrap_or(0);
            return Err(DecodeError::Checksum { received, computed: received.wrapping_sub(total) });
        }
        let request = Self::parse(opcode, Reader::new(body))?;
        Ok(Command { address, request })
    }

    fn parse(opcode: Opcode, mut body: Reader<'_>) -> Result<Self, DecodeError> {
        let request = match opcode {
            Opcode::GetAllAngles => Self::GetAllAngles,
            Opcode::GetAngle0 => Self::GetAngle(Axis::Zero),
            Opcode::GetAngle1 => Self::GetAngle(Axis::One),
            Opcode::GetAngle2 => Self::GetAngle(Axis::Two),
            Opcode::SetAngle => Self::SetAngle { axis: axis(&mut body)?, angle: Millidegrees(body.i32()) },
            Opcode::GetAllAngleOffsets => Self::GetAllAngleOffsets,
            Opcode::SetAngleOffset => {
                Self::SetAngleOffset { axis: axis(&mut body)?, offset: Millidegrees(body.i32()) }
            }
            Opcode::GetAllData => Self::GetAllData,
            Opcode::GetAllDirections => Self::GetAllDirections,
            Opcode::SetDirection => {
                Self::SetDirection { axis: axis(&mut body)?, direction: direction(body.u8())? }
            }
            Opcode::GetDamping => Self::GetDamping,
            Opcode::SetDamping => Self::SetDamping { damping_ms: body.u16() },
            Opcode::GetAngleOutputRange => Self::GetAngleOutputRange,
            Opcode::SetAngleOutputRange => Self::SetAngleOutputRange(range(body.u8())?),
            Opcode::GetDeviceInformation => Self::GetDeviceInformation,
            Opcode::SetBaudRate => {
                let index = body.u8();
                Self::SetBaudRate(BaudRate::new(index).ok_or(value(Field::BaudRate, index))?)
            }
            Opcode::SetAddress => {
                let (device_type, serial, new_address) = (body.u8(), body.u32(), body.u8());
                Self::SetAddress {
                    device_type: DeviceType::new(device_type).ok_or(value(Field::DeviceType, device_type))?,
                    serial,
                    new_address: Address::new(new_address).ok_or(value(Field::NewAddress, new_address))?,
                }
            }
        };
        match request.check() {
            Err(EncodeError::OutOfRange { field, value, .. }) => Err(DecodeError::Value { field, value }),
            _ => Ok(request),
        }
    }

    /// Checks the parameters against their documented limits.
    fn check(&self) -> Result<(), EncodeError> {
        let angles = (Millidegrees::MIN.0, Millidegrees::MAX.0);
        let (field, value, (min, max)) = match *self {
            Self::SetAngle { angle, .. } => (Field::Angle, angle.0, angles),
            Self::SetAngleOffset { offset, .. } => (Field::Offset, offset.0, angles),
            Self::SetDamping { damping_ms } => (
                Field::Damping,
                i32::from(damping_ms),
                (i32::from(MIN_DAMPING_MS), i32::from(MAX_DAMPING_MS)),
            ),
            Self::SetAddress { new_address, .. } => {
                (Field::NewAddress, i32::from(new_address.get()), (1, MAX_NEW_ADDRESS))
            }
            _ => return Ok(()),
        };
        if value < min || value > max {
            return Err(EncodeError::OutOfRange { field, value, min, max });
        }
        Ok(())
    }
}

/// Code of an output range. Source: §2.6.
pub(super) const fn range_code(range: Range) -> u8 {
    match range {
        Range::Bidirectional => 0,
        Range::Unidirectional => 1,
    }
}

pub(super) fn range(code: u8) -> Result<Range, DecodeError> {
    match code {
        0 => Ok(Range::Bidirectional),
        1 => Ok(Range::Unidirectional),
        _ => Err(value(Field::OutputRange, code)),
    }
}

pub(super) fn direction(code: u8) -> Result<Direction, DecodeError> {
    Direction::new(code).ok_or(value(Field::Direction, code))
}

fn axis(body: &mut Reader<'_>) -> Result<Axis, DecodeError> {
    let number = body.u8();
    Axis::new(number).ok_or(value(Field::Axis, number))
}

fn value(field: Field, code: u8) -> DecodeError {
    DecodeError::Value { field, value: i32::from(code) }
}
