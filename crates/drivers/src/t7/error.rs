//! Errors of a T7 driver.

use core::fmt::{self, Display};

use clino_bus::{Blame, Duration, Fault};
use clino_codec::t7::{Address, Axis, DecodeError, Differs, EncodeError, Field, Response, Status};

use crate::Suspect;
use crate::exchange::Failure;

/// Why a T7 did not do what it was asked. `E` is the port's error; [`blame`](Self::blame) says where
/// to look.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Error<E> {
    /// The request cannot be sent: a parameter is out of its range, which is in the error.
    Request(EncodeError),
    /// [`Address::ALL`], on a line that may have several devices.
    NotSingleDevice,
    /// The port could not send.
    Port(E),
    /// Another node did not stop transmitting: the request was not sent.
    LineBusy,
    /// The line stayed silent.
    NoAnswer {
        /// For how long.
        waited: Duration,
        /// The probable cause.
        suspect: Suspect,
    },
    /// Characters came, but no frame.
    Garbled {
        /// How many.
        characters: u32,
        /// The probable cause.
        suspect: Suspect,
    },
    /// A frame came, but not the awaited one, or it failed a check.
    Bad {
        /// What is wrong with it.
        error: DecodeError,
        /// The probable cause.
        suspect: Suspect,
    },
    /// The device reports that it did not carry out the command.
    Refused(Status),
    /// A single-axis T7 was asked for an axis that it does not have, for which it answers zero.
    NoSuchAxis(Axis),
    /// The device reports that it carried out the command, but has another value.
    NotKept {
        /// The setting.
        field: Field,
        /// What was written, in the unit of the message.
        written: i32,
        /// What was read back.
        found: i32,
    },
}

impl<E> Error<E> {
    /// Where to look for the cause.
    pub fn blame(&self) -> Blame {
        match self {
            Self::Request(_) | Self::NotSingleDevice | Self::NoSuchAxis(_) => Blame::Request,
            Self::Port(_) => Blame::Ourselves,
            Self::LineBusy | Self::Garbled { .. } => Blame::Line,
            Self::Bad { error, .. } => Fault::Bad(*error).blame(),
            Self::NoAnswer { .. } | Self::Refused(_) | Self::NotKept { .. } => Blame::Node,
        }
    }

    /// An answer to another command: the decoder does not let it pass.
    pub(super) fn foreign(address: Address, response: &Response) -> Self {
        let error = DecodeError::Foreign { address, opcode: response.opcode(), differs: Differs::Command };
        Self::Bad { error, suspect: Suspect::Foreign }
    }
}

impl<E> From<EncodeError> for Error<E> {
    fn from(error: EncodeError) -> Self {
        Self::Request(error)
    }
}

impl<E> From<Failure<clino_bus::T7, E>> for Error<E> {
    fn from(failure: Failure<clino_bus::T7, E>) -> Self {
        match failure {
            Failure::Request(error) => Self::Request(error),
            Failure::NotSingleDevice => Self::NotSingleDevice,
            Failure::Port(error) => Self::Port(error),
            Failure::Fault(Fault::NoAnswer { waited }, suspect) => Self::NoAnswer { waited, suspect },
            Failure::Fault(Fault::Garbled { characters }, suspect) => Self::Garbled { characters, suspect },
            Failure::Fault(Fault::Bad(error), suspect) => Self::Bad { error, suspect },
            Failure::Fault(Fault::LineBusy, _) => Self::LineBusy,
            // The port reports its own errors and contention; there are no exchanges with several answers here.
            Failure::Fault(Fault::NotSent | Fault::Contention | Fault::Over { .. }, _) => Self::LineBusy,
        }
    }
}

impl<E: Display> Display for Error<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Request(error) => write!(f, "not sent: {error}"),
            Self::NotSingleDevice => write!(
                f,
                "not sent: all T7s of the line would answer at once; make the driver with `single` if there is one"
            ),
            Self::Port(error) => write!(f, "not sent whole: {error}"),
            Self::LineBusy => write!(
                f,
                "not sent: the line did not fall silent; look for another master, a sensor that does not stop sending, \
                 and a line without bias"
            ),
            Self::NoAnswer { waited, suspect } => {
                write!(f, "no answer within {} µs: {suspect}", waited.as_micros())
            }
            Self::Garbled { characters, suspect } => {
                write!(f, "no frame in {characters} characters: {suspect}")
            }
            Self::Bad { error, suspect } => write!(f, "bad answer: {error}: {suspect}"),
            Self::Refused(status) => write!(f, "refused: {status}"),
            Self::NoSuchAxis(axis) => {
                write!(f, "a single-axis T7 has axis 2 only: its zero for axis {} is no angle", axis.get())
            }
            Self::NotKept { field, written, found } => {
                write!(f, "{field:?} was written as {written} and read back as {found}")
            }
        }
    }
}

impl<E: core::error::Error + 'static> core::error::Error for Error<E> {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Self::Request(error) => Some(error),
            Self::Port(error) => Some(error),
            Self::Bad { error, .. } => Some(error),
            _ => None,
        }
    }
}
