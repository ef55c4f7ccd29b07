//! Set zero: waits for the damping, then sets an axis to zero at its present angle.
//!
//! ```text
//!  (Axis ──▶) Damping ──▶ Settle ──▶ Watch ── zero ──▶ done
//!                                     │ ▲ │             ▲
//!                              moves  ▼ │ │ stands      │ zero, twice in a row
//!                                refused│ ▼ still       │
//!                                       │ Write ──────▶ Read
//!                                       │ not zero       │
//!                                       └────────────────┘
//! ```
//! The reported angle is an average over the damping time (section 2.5), so that it is right only when the axis has
//! stood still for that long. Whether it does is [watched](WATCH) before each write. An axis that not every T7 has is
//! [asked about](super::axis) first. Source: T7 guide sections 2.1.5, 2.5.1.

use clino_bus::{Duration, ExchangeOutcome, Instant, Protocol, T7};
use clino_codec::angle::{Angle, Range};
use clino_codec::t7::{Axis, MAX_DAMPING_MS, Millidegrees, Opcode, Request, Response, Status};

use super::set::refusal;
use super::{Cause, Device, Failure, Fault, axis};
use crate::motion::Motion;
use crate::{Operation, READ_TRIES, Step, StepOf, TaskProgress, WRITE_TRIES};

/// How far from zero an axis may read after it was set to zero: 0.1°. The guide gives no noise figure; a tenth of a degree
/// is a hundred steps of the reading, and far less than any offset worth setting.
pub const ZERO_TOLERANCE: Millidegrees = Millidegrees(100);

/// A turn, in 0.001°.
const TURN_MDEG: i32 = 360_000;

/// Added to the damping time, for the device's clock.
const SETTLE_MARGIN: Duration = Duration::from_millis(10);

/// Pauses between the readings by which motion is seen, 258 ms together.
///
/// - A zero is read back within 150 ms: 25 ms until a write is answered, two readings, and before each of the three an
///   exchange with another node (38 characters at 9600 bit/s: 40 ms). So an axis that passes moves by less than
///   [`ZERO_TOLERANCE`] until then. At a steady rate that is 0.1° in 258 ms, 0.39° a second.
/// - The sensor's bandwidth is 8 Hz (data sheet): a vibration of 125 ms and longer is seen over two periods. The pauses
///   differ, so that no period fits them all.
const WATCH: [Duration; 4] = [
    Duration::from_millis(37),
    Duration::from_millis(53),
    Duration::from_millis(71),
    Duration::from_millis(97),
];

/// Makes an axis read zero.
#[derive(Clone, Copy, Debug)]
pub struct SetZero {
    device: Device,
    axis: Axis,
    state: State,
    before: Option<Millidegrees>,
    /// What was read since it is watched.
    motion: Motion<TURN_MDEG>,
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
    /// Whether the device has the axis.
    Axis,
    Damping,
    Settle {
        until: Instant,
    },
    Watch {
        from: Instant,
    },
    Read,
    Write,
    Ended(Result<Zeroed, Failure>),
}

impl SetZero {
    /// Begins with reading the damping time. An axis that moves is refused, and one that the device does not have: before
    /// an axis other than 2 a [single device](Device::single) is refused, too, as it cannot be asked what it is.
    pub const fn new(device: Device, axis: Axis) -> SetZero {
        let state = if axis::is_in_question(axis) { State::Axis } else { State::Damping };
        SetZero {
            device,
            axis,
            state,
            before: None,
            motion: Motion::new(),
            was_zero: false,
            refused: None,
            writes: 0,
            cancelled: false,
        }
    }

    fn request(&self) -> Request {
        Request::SetAngle { axis: self.axis, angle: Millidegrees(0) }
    }

    #[inline(never)]
    fn fail(&mut self, cause: Cause) {
        self.state = State::Ended(Err(Failure { cause, writes: self.writes }));
    }

    #[inline(never)]
    fn no_answer(&mut self, opcode: Opcode, fault: Fault) {
        self.fail(Cause::NoAnswer { opcode, address: self.device.address(), fault });
    }

    /// A reading while it is watched whether the axis stands still.
    fn on_watch(&mut self, seen: Millidegrees, at: Instant) {
        if self.writes == 0 {
            self.before = Some(seen);
        }
        let readings = self.motion.readings();
        self.motion.take(seen.0, at);
        let was_zero = self.note(seen);
        if let Some(&pause) = WATCH.get(usize::from(readings)) {
            self.state = State::Watch { from: at + pause };
        } else if self.motion.spread() > ZERO_TOLERANCE.0.unsigned_abs() {
            self.fail(Cause::Moving { mdeg_per_s: self.motion.rate(self.motion.span()) });
        } else if was_zero && self.was_zero {
            self.done(seen);
        } else if self.cancelled {
            self.fail(Cause::Cancelled);
        } else {
            self.state = State::Write;
        }
    }

    /// A reading after a write.
    fn on_read_back(&mut self, seen: Millidegrees, at: Instant) {
        let was_zero = self.note(seen);
        if self.was_zero {
            // Still State::Read until it is zero twice in a row.
            if was_zero {
                self.done(seen);
            }
        } else if let Some(status) = self.refused {
            self.fail(Cause::Status { opcode: Opcode::SetAngle, status });
        } else if self.cancelled {
            self.fail(Cause::Cancelled);
        } else if self.writes >= WRITE_TRIES {
            self.fail(Cause::NotZero { seen });
        } else {
            self.motion = Motion::new();
            self.state = State::Watch { from: at };
        }
    }

    /// Notes whether this is zero; returns whether the reading before was.
    fn note(&mut self, seen: Millidegrees) -> bool {
        let is_zero = if self.writes == 0 { seen.0 == 0 } else { is_nearly_zero(seen) };
        core::mem::replace(&mut self.was_zero, is_zero)
    }

    fn done(&mut self, after: Millidegrees) {
        let before = self.before.unwrap_or(after);
        self.state = State::Ended(Ok(Zeroed { before, after, writes: self.writes }));
    }
}

impl Operation for SetZero {
    type Protocol = T7;
    type Event = core::convert::Infallible;
    type Report = Zeroed;
    type Error = Failure;

    fn next(&mut self, now: Instant) -> StepOf<Self> {
        if self.cancelled && self.writes == 0 && !matches!(self.state, State::Ended(_)) {
            self.fail(Cause::Cancelled);
        }
        let address = self.device.address();
        if let (State::Axis, Err(error)) = (self.state, T7::encode(address, &axis::QUESTION)) {
            self.fail(Cause::Refused(error));
        }
        if let State::Settle { until } = self.state
            && now >= until
        {
            self.state = State::Watch { from: until };
        }
        match self.state {
            State::Axis => Step::Ask { address, request: axis::QUESTION, tries: READ_TRIES },
            State::Damping => Step::Ask { address, request: Request::GetDamping, tries: READ_TRIES },
            State::Settle { until } => Step::Wait { until },
            State::Watch { from } if now < from => Step::Wait { until: from },
            State::Watch { .. } | State::Read => {
                Step::Ask { address, request: Request::GetAngle(self.axis), tries: READ_TRIES }
            }
            State::Write => Step::Ask { address, request: self.request(), tries: 1 },
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
            (State::Axis, Ok(answer)) => match axis::answered(self.axis, &answer.response) {
                Some(Ok(())) => self.state = State::Damping,
                Some(Err(cause)) => self.fail(cause),
                None => {}
            },
            (State::Axis, &Err(fault)) => self.no_answer(axis::QUESTION.opcode(), fault),
            (State::Damping, Ok(answer)) => {
                if let Response::GetDamping { damping_ms } = answer.response {
                    let damping = Duration::from_millis(u32::from(damping_ms.min(MAX_DAMPING_MS)));
                    self.state = State::Settle { until: outcome.at + damping + SETTLE_MARGIN };
                }
            }
            (State::Damping, &Err(fault)) => self.no_answer(Opcode::GetDamping, fault),
            (state @ (State::Watch { .. } | State::Read), Ok(answer)) => match (state, answer.response) {
                (State::Read, Response::GetAngle { angle, .. }) => self.on_read_back(angle, outcome.at),
                (_, Response::GetAngle { angle, .. }) => self.on_watch(angle, outcome.at),
                _ => {}
            },
            (State::Watch { .. } | State::Read, &Err(fault)) => {
                self.no_answer(Opcode::get_angle(self.axis), fault)
            }
            (State::Write, result) => {
                self.writes = self.writes.saturating_add(1);
                self.refused = result.as_ref().ok().and_then(|answer| refusal(&answer.response));
                self.state = State::Read;
            }
            (State::Settle { .. } | State::Ended(_), _) => {}
        }
        None
    }

    fn progress(&self) -> TaskProgress {
        match self.state {
            State::Axis | State::Damping => TaskProgress::new(0, 5),
            State::Settle { .. } => TaskProgress::new(1, 5),
            State::Watch { .. } => TaskProgress::new(2, 5),
            State::Write => TaskProgress::new(3, 5),
            State::Read => TaskProgress::new(4, 5),
            State::Ended(_) => TaskProgress::new(5, 5),
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
