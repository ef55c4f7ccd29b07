//! Changing a device's address.
//!
//! ```text
//!  Name ──▶ Probe the new one ──▶ Write ──▶ LookNew ── the device ──▶ done
//!               │ an answer        ▲            │ silence
//!               ▼                  │            ▼
//!             taken                └──────── LookOld ── silence ─▶ lost
//! ```
//! Set Address names the device by type and serial number, so that of two devices at one address only the one named
//! moves: this separates duplicates. Source: T7 guide sections 2.7.1, 2.8.

use clino_bus::{ExchangeOutcome, Instant, Protocol, T7};
use clino_codec::t7::{
    Address, DeviceInformation, DeviceType, EncodeError, Opcode, Request, Response, Status,
};

use super::set::refusal;
use super::{Cause, Failure, Fault};
use crate::{Operation, READ_TRIES, Report, Step, StepOf, TaskProgress, WRITE_TRIES};

/// Gives a device another address.
#[derive(Clone, Copy, Debug)]
pub struct ChangeAddress {
    from: Address,
    to: Address,
    device_type: Option<DeviceType>,
    serial: Option<u32>,
    state: State,
    refused: Option<Status>,
    writes: u8,
    cancelled: bool,
}

#[derive(Clone, Copy, Debug)]
enum State {
    /// Reads type and serial number at the old address.
    Name,
    /// No device may answer at the new address, however often it is asked.
    Probe {
        silences: u8,
    },
    Write,
    /// Is it at the new address?
    LookNew,
    /// It is not. Is it at the old one?
    LookOld,
    Ended(Result<Report<Address>, Failure>),
}

impl ChangeAddress {
    /// Changes the address of whichever device is at `from`, an address or a [`Device`](super::Device). Its type is taken from its product type: a name that
    /// ends in `-1` or `-3`.
    ///
    /// # Errors
    /// [`EncodeError`] for an address that cannot be given (1–100 can), and for 126 as `from`.
    pub fn new(from: impl Into<Address>, to: Address) -> Result<ChangeAddress, EncodeError> {
        Self::checked(from.into(), to, None, None)
    }

    /// Changes the address of the device with that serial number. Two devices may share the address `from`: the one named
    /// moves, the other stays.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn of(
        from: impl Into<Address>,
        to: Address,
        device_type: DeviceType,
        serial: u32,
    ) -> Result<ChangeAddress, EncodeError> {
        Self::checked(from.into(), to, Some(device_type), Some(serial))
    }

    fn checked(
        from: Address,
        to: Address,
        device_type: Option<DeviceType>,
        serial: Option<u32>,
    ) -> Result<ChangeAddress, EncodeError> {
        let any = Request::SetAddress { device_type: DeviceType::T7_1, serial: 0, new_address: to };
        T7::encode(from, &Request::GetDeviceInformation)?;
        // Back to where it is already, the factory's address included, is no change.
        if from != to {
            T7::encode(from, &any)?;
        }
        let named = device_type.is_some() && serial.is_some() && from != to;
        let state = if named { State::Probe { silences: 0 } } else { State::Name };
        Ok(ChangeAddress { from, to, device_type, serial, state, refused: None, writes: 0, cancelled: false })
    }

    fn write(&self) -> Request {
        Request::SetAddress {
            device_type: self.device_type.unwrap_or(DeviceType::T7_1),
            serial: self.serial.unwrap_or(0),
            new_address: self.to,
        }
    }

    #[inline(never)]
    fn fail(&mut self, cause: Cause) {
        self.state = State::Ended(Err(Failure { cause, writes: self.writes }));
    }

    fn done(&mut self) {
        // Without a write it already had the new address.
        let from = if self.writes == 0 { self.to } else { self.from };
        self.state = State::Ended(Ok(Report::new(from, self.to, self.writes)));
    }

    /// A device has answered at the old address before anything was written.
    fn on_name(&mut self, information: &DeviceInformation) {
        let wanted = *self.serial.get_or_insert(information.serial);
        if wanted != information.serial {
            self.fail(Cause::WrongSerial { address: self.from, wanted, seen: information.serial });
            return;
        }
        if self.from == self.to {
            self.done();
            return;
        }
        match self.device_type.or_else(|| device_type(information)) {
            Some(device_type) => {
                self.device_type = Some(device_type);
                self.state = State::Probe { silences: 0 };
            }
            None => self.fail(Cause::UnknownProduct { product: information.product }),
        }
    }

    fn on_probe(&mut self, silences: u8, result: Result<u32, Fault>) {
        match result {
            Ok(serial) if self.serial == Some(serial) => self.done(),
            Ok(serial) => self.fail(Cause::AddressTaken { address: self.to, serial: Some(serial) }),
            Err(Fault::NoAnswer { .. }) if silences.saturating_add(1) < READ_TRIES => {
                self.state = State::Probe { silences: silences.saturating_add(1) };
            }
            Err(Fault::NoAnswer { .. }) => self.state = State::Write,
            Err(Fault::Garbled { .. } | Fault::Bad(_)) => {
                self.fail(Cause::AddressTaken { address: self.to, serial: None });
            }
            Err(fault) => self.no_answer(self.to, fault),
        }
    }

    #[inline(never)]
    fn no_answer(&mut self, address: Address, fault: Fault) {
        self.fail(Cause::NoAnswer { opcode: Opcode::GetDeviceInformation, address, fault });
    }

    fn on_look_new(&mut self, result: Result<u32, Fault>) {
        match result {
            Ok(serial) if self.serial == Some(serial) => self.done(),
            Ok(serial) => self.fail(Cause::AddressTaken { address: self.to, serial: Some(serial) }),
            Err(Fault::NoAnswer { .. }) => self.state = State::LookOld,
            Err(fault) => self.no_answer(self.to, fault),
        }
    }

    fn on_look_old(&mut self, result: Result<u32, Fault>) {
        // It, or a namesake: a duplicate there keeps answering, and both together are garbled.
        let answered = matches!(result, Ok(_) | Err(Fault::Garbled { .. } | Fault::Bad(_)));
        if let Err(fault) = result
            && !answered
        {
            self.fail(Cause::Lost { fault });
        } else if let Some(status) = self.refused {
            self.fail(Cause::Status { opcode: Opcode::SetAddress, status });
        } else if self.cancelled {
            self.fail(Cause::Cancelled);
        } else if self.writes >= WRITE_TRIES {
            self.fail(Cause::StillAt { address: self.from });
        } else {
            self.state = State::Write;
        }
    }
}

impl Operation for ChangeAddress {
    type Protocol = T7;
    type Event = core::convert::Infallible;
    type Report = Report<Address>;
    type Error = Failure;

    fn next(&mut self, _: Instant) -> StepOf<Self> {
        if self.cancelled && self.writes == 0 && !matches!(self.state, State::Ended(_)) {
            self.fail(Cause::Cancelled);
        }
        let request = Request::GetDeviceInformation;
        match self.state {
            State::Name | State::LookOld => Step::Ask { address: self.from, request, tries: READ_TRIES },
            State::Probe { .. } => Step::Ask { address: self.to, request, tries: 1 },
            State::Write => Step::Ask { address: self.from, request: self.write(), tries: 1 },
            State::LookNew => Step::Ask { address: self.to, request, tries: READ_TRIES },
            State::Ended(_) => Step::Done,
        }
    }

    fn result(&self) -> Option<Result<Self::Report, Self::Error>> {
        match self.state {
            State::Ended(result) => Some(result),
            _ => None,
        }
    }

    fn on(&mut self, outcome: &ExchangeOutcome<T7>) -> Option<Self::Event> {
        if matches!(self.state, State::Write) {
            self.writes = self.writes.saturating_add(1);
            self.refused = outcome.result.as_ref().ok().and_then(|answer| refusal(&answer.response));
            self.state = State::LookNew;
            return None;
        }
        let information = match &outcome.result {
            Ok(answer) => match &answer.response {
                Response::GetDeviceInformation(information) => Ok(information),
                _ => return None,
            },
            Err(fault) => Err(*fault),
        };
        let serial = information.map(|information| information.serial);
        match (&self.state, information) {
            (State::Name, Ok(information)) => self.on_name(information),
            (State::Name, Err(fault)) => self.no_answer(self.from, fault),
            (&State::Probe { silences }, _) => self.on_probe(silences, serial),
            (State::LookNew, _) => self.on_look_new(serial),
            (State::LookOld, _) => self.on_look_old(serial),
            (State::Write | State::Ended(_), _) => {}
        }
        None
    }

    fn progress(&self) -> TaskProgress {
        let done = match self.state {
            State::Name => 0,
            State::Probe { silences } => u16::from(silences).saturating_add(1),
            State::Write => 4,
            State::LookNew => 5,
            State::LookOld => 6,
            State::Ended(_) => 7,
        };
        TaskProgress::new(done, 7)
    }

    fn cancel(&mut self) {
        self.cancelled = true;
    }
}

/// The type that the product's name tells: `T7-1…` has one axis, `T7-3…` three. The guide's own example is named `X4-1`.
fn device_type(information: &DeviceInformation) -> Option<DeviceType> {
    let mut parts = information.product.trimmed().split(|&byte| byte == b'-').skip(1);
    match parts.next() {
        Some(b"1") => Some(DeviceType::T7_1),
        Some(b"3") => Some(DeviceType::T7_3),
        _ => None,
    }
}
