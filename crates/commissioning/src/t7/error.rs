//! Why an operation on a T7 failed, and what was seen.

use core::fmt;

use clino_codec::t7::{
    Address, Axis, BaudRate, DecodeError, EncodeError, Millidegrees, Opcode, Status, Text,
};

use super::DeviceSetting;

/// What is wrong with an exchange.
pub type Fault = clino_bus::Fault<DecodeError>;

/// An operation failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Failure {
    /// Why.
    pub cause: Cause,
    /// Commands sent that write non-volatile memory, whether or not they arrived.
    pub writes: u8,
}

/// Why an operation failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Cause {
    /// The caller asked for something that no device can do. Nothing was sent.
    Refused(EncodeError),
    /// Nothing is written to all devices at once. Nothing was sent.
    WritesToAll {
        /// What was asked for.
        opcode: Opcode,
    },
    /// No good answer, however often it was asked.
    NoAnswer {
        /// What was asked.
        opcode: Opcode,
        /// The device that was asked.
        address: Address,
        /// The last fault.
        #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
        fault: Fault,
    },
    /// The device refuses the change.
    Status {
        /// What was asked.
        opcode: Opcode,
        /// Its status byte.
        status: Status,
    },
    /// The value cannot be in the device's output range.
    OutOfRange {
        /// What was asked for.
        value: Millidegrees,
        /// Lowest angle of the output range.
        min: Millidegrees,
        /// Highest angle of the output range.
        max: Millidegrees,
    },
    /// It was written as often as is reasonable, and still does not read as wished.
    NotTaken {
        /// What it should be.
        wanted: DeviceSetting,
        /// What it reads.
        seen: DeviceSetting,
    },
    /// The axis does not read zero after having been set to zero: something else moves it.
    NotZero {
        /// What it reads.
        seen: Millidegrees,
    },
    /// The axis moves: a zero would not hold until it is read back.
    Moving {
        /// How fast, in 0.001° a second.
        mdeg_per_s: u32,
    },
    /// A single-axis device does not have the axis, and answers zero for it. Nothing was written.
    NoSuchAxis {
        /// Which one.
        axis: Axis,
    },
    /// The product type tells neither a T7-1 nor a T7-3; the caller has to say which.
    UnknownProduct {
        /// What it says.
        product: Text,
    },
    /// Another device is there.
    WrongSerial {
        /// Where.
        address: Address,
        /// Serial number of the device that is meant.
        wanted: u32,
        /// Serial number of the device that answered.
        seen: u32,
    },
    /// Another device answers at the new address.
    AddressTaken {
        /// The new address.
        address: Address,
        /// Its serial number, if it could be understood: two devices there talk over each other.
        serial: Option<u32>,
    },
    /// The device is still at its old address.
    StillAt {
        /// The old address.
        address: Address,
    },
    /// The device still has its old bit rate, and the line too.
    StillAtRate {
        /// The old bit rate.
        rate: BaudRate,
    },
    /// The device answers neither at its old nor at its new place. The line has its old bit rate.
    Lost {
        /// The last fault.
        #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
        fault: Fault,
    },
    /// The caller stopped it.
    Cancelled,
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} (writes sent: {})", self.cause, self.writes)
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Refused(error) => write!(f, "{error}"),
            Self::WritesToAll { opcode } => write!(f, "{opcode:?} would write to all devices at once"),
            Self::NoAnswer { opcode, address, fault } => {
                write!(f, "no answer to {opcode:?} from address {}: {fault:?}", address.get())
            }
            Self::Status { opcode, status } => write!(f, "the device refuses {opcode:?}: {status:?}"),
            Self::OutOfRange { value, min, max } => {
                write!(f, "{} is not in the output range {}..={} (0.001 degrees)", value.0, min.0, max.0)
            }
            Self::NotTaken { wanted, seen } => write!(f, "it reads {seen:?}, not {wanted:?}"),
            Self::NotZero { seen } => write!(f, "the axis reads {} (0.001 degrees), not 0", seen.0),
            Self::Moving { mdeg_per_s } => {
                write!(f, "the axis moves at {mdeg_per_s} (0.001 degrees a second)")
            }
            Self::NoSuchAxis { axis } => {
                write!(f, "a single-axis T7 has axis 2 only: its zero for axis {} is no angle", axis.get())
            }
            Self::UnknownProduct { product } => {
                write!(f, "product type {:?} tells no device type", product.as_str().unwrap_or("?"))
            }
            Self::WrongSerial { address, wanted, seen } => {
                write!(f, "serial number {seen} instead of {wanted} at address {}", address.get())
            }
            Self::AddressTaken { address, serial: Some(serial) } => {
                write!(f, "address {} is taken by serial number {serial}", address.get())
            }
            Self::AddressTaken { address, serial: None } => {
                write!(f, "a device answers at address {}, unintelligibly", address.get())
            }
            Self::StillAt { address } => write!(f, "the device is still at address {}", address.get()),
            Self::StillAtRate { rate } => {
                write!(f, "the device is still at {} bit/s", rate.bits_per_second())
            }
            Self::Lost { fault } => write!(f, "the device is at neither place: {fault:?}"),
            Self::Cancelled => write!(f, "cancelled"),
        }
    }
}

impl core::error::Error for Failure {}
impl core::error::Error for Cause {}
