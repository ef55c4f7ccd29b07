//! The identity and settings of a device. Source: T7 guide sections 2.2.1, 2.4.1, 2.5.1, 2.6.1, 2.7.1.

use clino_bus::{ExchangeOutcome, Instant, Protocol, T7};
use clino_codec::angle::Range;
use clino_codec::t7::{
    Address, DeviceInformation, Direction, EncodeError, Millidegrees, Opcode, Request, Response,
};

use super::{Cause, Device, Failure};
use crate::{Operation, READ_TRIES, Step, StepOf, TaskProgress};

/// Reads everything that a device keeps.
#[derive(Clone, Copy, Debug)]
pub struct Identify {
    address: Address,
    identity: Identity,
    state: State,
}

/// The identity and settings of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Identity {
    /// Serial number, firmware version, product type.
    pub information: DeviceInformation,
    /// Counting directions by axis.
    pub directions: [Direction; 3],
    /// Averaging time in milliseconds.
    pub damping_ms: u16,
    /// Output range.
    pub range: Range,
    /// Offsets by axis.
    pub offsets: [Millidegrees; 3],
}

#[derive(Clone, Copy, Debug)]
enum State {
    /// Asks the request of that number.
    Ask(u8),
    Failed(Cause),
}

/// What is asked, in this order.
const REQUESTS: [Request; 5] = [
    Request::GetDeviceInformation,
    Request::GetAllDirections,
    Request::GetDamping,
    Request::GetAngleOutputRange,
    Request::GetAllAngleOffsets,
];

/// Before anything has been read.
const BLANK: Identity = Identity {
    information: DeviceInformation {
        serial: 0,
        firmware: clino_codec::t7::Text::new(*b"      "),
        product: clino_codec::t7::Text::new(*b"      "),
        calibration_state: 0,
    },
    directions: [Direction::Normal; 3],
    damping_ms: 0,
    range: Range::Bidirectional,
    offsets: [Millidegrees(0); 3],
};

impl Identify {
    /// Begins with Get Device Information.
    ///
    /// # Errors
    /// [`EncodeError::NotForAll`] for a [single device](Device::single): these answers are too long for it.
    pub fn new(device: Device) -> Result<Identify, EncodeError> {
        let address = device.address();
        for request in &REQUESTS {
            T7::encode(address, request)?;
        }
        Ok(Identify { address, identity: BLANK, state: State::Ask(0) })
    }

    fn take(&mut self, response: &Response) {
        match *response {
            Response::GetDeviceInformation(information) => self.identity.information = information,
            Response::GetAllDirections { directions } => self.identity.directions = directions,
            Response::GetDamping { damping_ms } => self.identity.damping_ms = damping_ms,
            Response::GetAngleOutputRange(range) => self.identity.range = range,
            Response::GetAllAngleOffsets { offsets } => self.identity.offsets = offsets,
            _ => {}
        }
    }
}

impl Operation for Identify {
    type Protocol = T7;
    type Event = core::convert::Infallible;
    type Report = Identity;
    type Error = Failure;

    fn next(&mut self, _: Instant) -> StepOf<Self> {
        match self.state {
            State::Ask(number) => match REQUESTS.get(usize::from(number)) {
                Some(&request) => Step::Ask { address: self.address, request, tries: READ_TRIES },
                None => Step::Done,
            },
            State::Failed(_) => Step::Done,
        }
    }

    fn result(&self) -> Option<Result<Self::Report, Self::Error>> {
        match self.state {
            State::Ask(number) if usize::from(number) < REQUESTS.len() => None,
            State::Ask(_) => Some(Ok(self.identity)),
            State::Failed(cause) => Some(Err(Failure { cause, writes: 0 })),
        }
    }

    fn on(&mut self, outcome: &ExchangeOutcome<T7>) -> Option<Self::Event> {
        let State::Ask(number) = self.state else { return None };
        self.state = match outcome.result {
            Ok(answer) => {
                self.take(&answer.response);
                State::Ask(number.saturating_add(1))
            }
            Err(fault) => {
                let opcode = REQUESTS.get(usize::from(number)).map_or(Opcode::GetAllData, Request::opcode);
                State::Failed(Cause::NoAnswer { opcode, address: self.address, fault })
            }
        };
        None
    }

    fn progress(&self) -> TaskProgress {
        let of = REQUESTS.len() as u16;
        match self.state {
            State::Ask(number) => TaskProgress::new(u16::from(number), of),
            State::Failed(_) => TaskProgress::new(of, of),
        }
    }

    fn cancel(&mut self) {
        if self.progress().done < REQUESTS.len() as u16 {
            self.state = State::Failed(Cause::Cancelled);
        }
    }
}
