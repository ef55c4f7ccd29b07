//! Offset, direction, damping, output range: read, compare, write only a difference, read back.
//!
//! ```text
//!  (Axis ──▶) (Range ──▶) Read ── as wished, twice in a row ──▶ done
//!                           │ ▲
//!              differs      ▼ │ after any answer
//!                         Write
//! ```
//! An axis that not every T7 has is [asked about](super::axis) first.
//!
//! Two errors in one answer can cancel in its 8-bit sum; the same two in the next answer are another matter. So it takes
//! two readings to believe that a setting is as wished.
//!
//! Source: T7 guide sections 2.2, 2.4, 2.5, 2.6.

use clino_bus::{ExchangeOutcome, Instant, Protocol, T7};
use clino_codec::angle::Range;
use clino_codec::t7::{EncodeError, Millidegrees, Opcode, Request, Response, Status};

use super::{Cause, Device, DeviceSetting, Failure, Fault, axis};
use crate::{Operation, READ_TRIES, Report, Step, StepOf, TaskProgress, WRITE_TRIES};

/// Gives a setting a value.
#[derive(Clone, Copy, Debug)]
pub struct Set {
    device: Device,
    wanted: DeviceSetting,
    state: State,
    /// As read before anything was written.
    before: Option<DeviceSetting>,
    /// The last reading was as wished.
    as_wished: bool,
    /// What the device said to the last write, if that was a refusal.
    refused: Option<Status>,
    writes: u8,
    cancelled: bool,
}

#[derive(Clone, Copy, Debug)]
enum State {
    /// Whether the device has the axis.
    Axis,
    /// Offsets have to be within the output range, so that is read first.
    Range,
    Read,
    Write,
    Ended(Result<Report<DeviceSetting>, Failure>),
}

impl Set {
    /// Begins with reading.
    ///
    /// # Errors
    /// [`EncodeError::OutOfRange`] with the limits; [`EncodeError::NotForAll`] for an offset, and for an axis other than 2, of a
    /// [single device](Device::single), whose address must be known.
    pub fn new(device: Device, wanted: DeviceSetting) -> Result<Set, EncodeError> {
        T7::encode(device.address(), &wanted.set())?;
        T7::encode(device.address(), &wanted.get())?;
        let mut set = Set {
            device,
            wanted,
            state: State::Axis,
            before: None,
            as_wished: false,
            refused: None,
            writes: 0,
            cancelled: false,
        };
        match wanted.axis() {
            Some(axis) if axis::is_in_question(axis) => {
                T7::encode(device.address(), &axis::QUESTION).map(|_| ())?
            }
            _ => set.begin(),
        }
        Ok(set)
    }

    /// The device has the axis, or there is none.
    const fn begin(&mut self) {
        let is_offset = matches!(self.wanted, DeviceSetting::Offset { .. });
        self.state = if is_offset { State::Range } else { State::Read };
    }

    #[inline(never)]
    fn fail(&mut self, cause: Cause) {
        self.state = State::Ended(Err(Failure { cause, writes: self.writes }));
    }

    #[inline(never)]
    fn no_answer(&mut self, opcode: Opcode, fault: Fault) {
        self.fail(Cause::NoAnswer { opcode, address: self.device.address(), fault });
    }

    fn on_range(&mut self, range: Range) {
        let DeviceSetting::Offset { offset, .. } = self.wanted else { return };
        let (min, max) = limits(range);
        if offset < min || offset > max {
            self.fail(Cause::OutOfRange { value: offset, min, max });
        } else {
            self.state = State::Read;
        }
    }

    fn on_reading(&mut self, seen: DeviceSetting) {
        if self.writes == 0 {
            self.before = Some(seen);
        }
        let before = self.before.unwrap_or(seen);
        let confirmed = core::mem::replace(&mut self.as_wished, seen == self.wanted);
        if seen == self.wanted {
            // Still State::Read until then.
            if confirmed {
                self.state = State::Ended(Ok(Report::new(before, seen, self.writes)));
            }
        } else if let Some(status) = self.refused {
            self.fail(Cause::Status { opcode: self.wanted.set().opcode(), status });
        } else if self.cancelled {
            self.fail(Cause::Cancelled);
        } else if self.writes >= WRITE_TRIES {
            self.fail(Cause::NotTaken { wanted: self.wanted, seen });
        } else {
            self.state = State::Write;
        }
    }
}

impl Operation for Set {
    type Protocol = T7;
    type Event = core::convert::Infallible;
    type Report = Report<DeviceSetting>;
    type Error = Failure;

    fn next(&mut self, _: Instant) -> StepOf<Self> {
        if self.cancelled && self.writes == 0 && !matches!(self.state, State::Ended(_)) {
            self.fail(Cause::Cancelled);
        }
        let address = self.device.address();
        match self.state {
            State::Axis => Step::Ask { address, request: axis::QUESTION, tries: READ_TRIES },
            State::Range => Step::Ask { address, request: Request::GetAngleOutputRange, tries: READ_TRIES },
            State::Read => Step::Ask { address, request: self.wanted.get(), tries: READ_TRIES },
            State::Write => Step::Ask { address, request: self.wanted.set(), tries: 1 },
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
        match (&self.state, &outcome.result) {
            (State::Axis, Ok(answer)) => {
                match self.wanted.axis().and_then(|axis| axis::answered(axis, &answer.response)) {
                    Some(Ok(())) => self.begin(),
                    Some(Err(cause)) => self.fail(cause),
                    None => {}
                }
            }
            (State::Axis, &Err(fault)) => self.no_answer(axis::QUESTION.opcode(), fault),
            (State::Range, Ok(answer)) => {
                if let Response::GetAngleOutputRange(range) = answer.response {
                    self.on_range(range);
                }
            }
            (State::Range, &Err(fault)) => self.no_answer(Opcode::GetAngleOutputRange, fault),
            (State::Read, Ok(answer)) => {
                if let Some(seen) = self.wanted.read(&answer.response) {
                    self.on_reading(seen);
                }
            }
            (State::Read, &Err(fault)) => self.no_answer(self.wanted.get().opcode(), fault),
            (State::Write, result) => {
                self.writes = self.writes.saturating_add(1);
                self.refused = result.as_ref().ok().and_then(|answer| refusal(&answer.response));
                self.state = State::Read;
            }
            (State::Ended(_), _) => {}
        }
        None
    }

    fn progress(&self) -> TaskProgress {
        match self.state {
            State::Axis | State::Range => TaskProgress::new(0, 4),
            State::Read if self.writes == 0 => TaskProgress::new(1, 4),
            State::Write => TaskProgress::new(2, 4),
            State::Read => TaskProgress::new(3, 4),
            State::Ended(_) => TaskProgress::new(4, 4),
        }
    }

    fn cancel(&mut self) {
        self.cancelled = true;
    }
}

/// What the device has against the command; not that it came damaged, which is worth another try.
pub(super) fn refusal(response: &Response) -> Option<Status> {
    response.status().filter(|status| !matches!(status, Status::Success | Status::ChecksumError))
}

/// Lowest and highest angle of an output range (section 1).
fn limits(range: Range) -> (Millidegrees, Millidegrees) {
    match range {
        Range::Bidirectional => (Millidegrees(-180_000), Millidegrees(179_999)),
        Range::Unidirectional => (Millidegrees(0), Millidegrees(359_999)),
    }
}
