//! Set zero: waits out the damping, then makes an axis read zero as it stands.
//!
//! ```text
//!  Damping ──▶ Settle ──▶ Read ── zero, twice in a row ──▶ done
//!                          │ ▲
//!                  not     ▼ │ whatever was answered
//!                         Write
//! ```
//! The reported angle is an average over the damping time (section 2.5), so that it is right only when the axis has
//! stood still for that long. Source: T7 guide sections 2.1.5, 2.5.1.

use clino_bus::{Micros, Outcome, T7};
use clino_codec::angle::{Angle, Range};
use clino_codec::t7::{Axis, MAX_DAMPING_MS, Millidegrees, Opcode, Request, Response, Status};

use super::set::refusal;
use super::{Cause, Device, Failure, Fault};
use crate::{Operation, Progress, READ_TRIES, Step, StepOf, WRITE_TRIES};

/// How far from zero an axis may read after it was set to zero: 0.1°. The guide gives no noise figure; a tenth of a degree
/// is a hundred steps of the reading, and far less than any offset worth setting.
pub const ZERO_TOLERANCE: Millidegrees = Millidegrees(100);

/// Added to the damping time, for the device's clock.
const SETTLE_MARGIN: Micros = Micros::from_millis(10);

/// Makes an axis read zero.
#[derive(Clone, Copy, Debug)]
pub struct SetZero {
    device: Device,
    axis: Axis,
    state: State,
    before: Option<Millidegrees>,
    /// The last reading was zero: two errors can cancel in the sum of one answer, so it takes two.
    was_zero: bool,
    refused: Option<Status>,
    writes: u8,
    cancelled: bool,
}

/// What an axis read before and after.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Zeroed {
    /// Once the damping had been waited out. Exactly zero: nothing was written.
    pub before: Millidegrees,
    /// As read back, within [`ZERO_TOLERANCE`] of zero.
    pub after: Millidegrees,
    /// Commands sent that write non-volatile memory, whether or not they arrived.
    pub writes: u8,
}

#[derive(Clone, Copy, Debug)]
enum State {
    Damping,
    Settle { until: Micros },
    Read,
    Write,
    Ended(Result<Zeroed, Failure>),
}

impl SetZero {
    /// Begins with reading the damping time. The axis should stand still.
    pub const fn new(device: Device, axis: Axis) -> SetZero {
        SetZero {
            device,
            axis,
            state: State::Damping,
            before: None,
            was_zero: false,
            refused: None,
            writes: 0,
            cancelled: false,
        }
    }

    fn request(&self) -> Request {
        Request::SetAngle { axis: self.axis, angle: Millidegrees(0) }
    }

    fn fail(&mut self, cause: Cause) {
        self.state = State::Ended(Err(Failure { cause, writes: self.writes }));
    }

    fn no_answer(&mut self, opcode: Opcode, fault: Fault) {
        self.fail(Cause::NoAnswer { opcode, address: self.device.address(), fault });
    }

    fn on_angle(&mut self, seen: Millidegrees) {
        if self.writes == 0 {
            self.before = Some(seen);
        }
        let before = self.before.unwrap_or(seen);
        let is_zero = if self.writes == 0 { seen.0 == 0 } else { is_nearly_zero(seen) };
        let confirmed = core::mem::replace(&mut self.was_zero, is_zero);
        if is_zero {
            // Still State::Read until then.
            if confirmed {
                self.state = State::Ended(Ok(Zeroed { before, after: seen, writes: self.writes }));
            }
        } else if let Some(status) = self.refused {
            self.fail(Cause::Status { opcode: Opcode::SetAngle, status });
        } else if self.cancelled {
            self.fail(Cause::Cancelled);
        } else if self.writes >= WRITE_TRIES {
            self.fail(Cause::NotZero { seen });
        } else {
            self.state = State::Write;
        }
    }
}

impl Operation for SetZero {
    type Protocol = T7;
    type Event = core::convert::Infallible;
    type Report = Zeroed;
    type Error = Failure;

    fn next(&mut self, now: Micros) -> StepOf<Self> {
        if self.cancelled && self.writes == 0 && !matches!(self.state, State::Ended(_)) {
            self.fail(Cause::Cancelled);
        }
        if let State::Settle { until } = self.state
            && now >= until
        {
            self.state = State::Read;
        }
        let address = self.device.address();
        match self.state {
            State::Damping => Step::Ask { address, request: Request::GetDamping, tries: READ_TRIES },
            State::Settle { until } => Step::Wait { until },
            State::Read => Step::Ask { address, request: Request::GetAngle(self.axis), tries: READ_TRIES },
            State::Write => Step::Ask { address, request: self.request(), tries: 1 },
            State::Ended(result) => Step::Done(result),
        }
    }

    fn on(&mut self, outcome: &Outcome<T7>) -> Option<Self::Event> {
        match (self.state, outcome.result) {
            (State::Damping, Ok(answer)) => {
                if let Response::GetDamping { damping_ms } = answer.response {
                    let damping = Micros::from_millis(u32::from(damping_ms.min(MAX_DAMPING_MS)));
                    self.state = State::Settle { until: outcome.at + damping + SETTLE_MARGIN };
                }
            }
            (State::Damping, Err(fault)) => self.no_answer(Opcode::GetDamping, fault),
            (State::Read, Ok(answer)) => {
                if let Response::GetAngle { angle, .. } = answer.response {
                    self.on_angle(angle);
                }
            }
            (State::Read, Err(fault)) => self.no_answer(Opcode::get_angle(self.axis), fault),
            (State::Write, result) => {
                self.writes = self.writes.saturating_add(1);
                self.refused = result.ok().and_then(|answer| refusal(&answer.response));
                self.state = State::Read;
            }
            (State::Settle { .. } | State::Ended(_), _) => {}
        }
        None
    }

    fn progress(&self) -> Progress {
        match self.state {
            State::Damping => Progress::new(0, 5),
            State::Settle { .. } => Progress::new(1, 5),
            State::Read if self.writes == 0 => Progress::new(2, 5),
            State::Write => Progress::new(3, 5),
            State::Read => Progress::new(4, 5),
            State::Ended(_) => Progress::new(5, 5),
        }
    }

    fn cancel(&mut self) {
        self.cancelled = true;
    }
}

/// Just below 360° is just below zero.
fn is_nearly_zero(angle: Millidegrees) -> bool {
    angle.angle().is_some_and(|angle| {
        angle.normalised(Range::Bidirectional).udeg().unsigned_abs()
            <= ZERO_TOLERANCE.angle().unwrap_or(Angle::ZERO).udeg().unsigned_abs()
    })
}
