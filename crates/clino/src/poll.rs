//! Reading the same sensors again and again, as an operation: `watch` and `log` run it until the user wants to stop.
//!
//! Sensors take turns. One that is silent several times in a row is asked once a second, so that it costs the others little.
//!
//! A single-axis T7 has axis 2 and answers zero for the others (guide section 1). So a T7 that is read at another axis is asked
//! what it is before its first value, and again when it was silent: another one may be in its place.

use std::convert::Infallible;

use clino_bus::{Duration, ExchangeOutcome, Fault, Instant, Isu, Protocol, T7};
use clino_codec::isu::Response as IsuResponse;
use clino_codec::t7::{Axis, DecodeError, Field, Request as T7Request, Response as T7Response};
use clino_commissioning::{Commissionable, Operation, Step, StepOf, TaskProgress};
use clino_gateway::Status;

/// Requests of one reading. A retry waits until no late answer can come, 25 ms at a T7 and 400 ms at an ISU, in which all others
/// would wait, too: the next reading does as well.
const TRIES: u8 = 1;
/// A sensor that was silent this many times in a row is asked less often.
const SILENT: u8 = 3;
/// How often it is asked then.
const SELDOM: Duration = Duration::from_millis(1_000);

/// What a sensor measures, as it says it, and as an angle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Measured {
    /// T7: 0.001°; ISU: 360/65536°.
    pub raw: i32,
    /// In 0.001°.
    pub mdeg: i32,
}

/// A protocol whose sensors measure an angle.
pub trait Measures: Protocol<Request: Copy> + Commissionable {
    /// The angle of an answer.
    ///
    /// # Errors
    /// There is none in it.
    fn measured(answer: &Self::Answer) -> Result<Measured, Status>;

    /// What an answer that was refused comes to.
    fn refused(error: &Self::DecodeError) -> Status;

    /// What the sensor is asked before this request's values are believed, if it has to be asked.
    fn doubt(_: &Self::Request) -> Option<Self::Request> {
        None
    }

    /// Whether its answer to that lets this request's values be believed.
    ///
    /// # Errors
    /// It does not: what the values come to.
    fn is_believed(_: &Self::Request, _: &Self::Answer) -> Result<(), Status> {
        Ok(())
    }
}

impl Measures for T7 {
    fn measured(answer: &Self::Answer) -> Result<Measured, Status> {
        match answer.response {
            T7Response::GetAngle { angle, .. } => match angle.angle() {
                Some(_) => Ok(Measured { raw: angle.0, mdeg: angle.0 }),
                None => Err(Status::OutOfRange),
            },
            _ => Err(Status::BadAnswer),
        }
    }

    fn refused(error: &DecodeError) -> Status {
        match error {
            DecodeError::Value { field: Field::Angle, .. } => Status::OutOfRange,
            _ => Status::BadAnswer,
        }
    }

    fn doubt(request: &T7Request) -> Option<T7Request> {
        match request {
            T7Request::GetAngle(Axis::Zero | Axis::One) => Some(T7Request::GetDeviceInformation),
            _ => None,
        }
    }

    fn is_believed(request: &T7Request, answer: &Self::Answer) -> Result<(), Status> {
        match (request, answer.response) {
            (T7Request::GetAngle(axis), T7Response::GetDeviceInformation(information)) => {
                if information.has_axis(*axis) { Ok(()) } else { Err(Status::ConfigFault) }
            }
            _ => Err(Status::BadAnswer),
        }
    }
}

impl Measures for Isu {
    fn measured(answer: &Self::Answer) -> Result<Measured, Status> {
        match (&answer.response, answer.response.angle_word()) {
            (IsuResponse::Error(_), _) => Err(Status::DeviceError),
            (_, Some(word)) => {
                let mdeg = clino_codec::angle::Angle::from_turn16(word).mdeg();
                Ok(Measured { raw: word.into(), mdeg })
            }
            (_, None) => Err(Status::BadAnswer),
        }
    }

    fn refused(_: &Self::DecodeError) -> Status {
        Status::BadAnswer
    }
}

/// What is asked of a sensor.
pub struct Question<P: Protocol> {
    pub address: P::Address,
    pub request: P::Request,
}

/// A reading that has ended, of the sensor of that number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Polled {
    pub sensor: usize,
    pub result: Result<Measured, Status>,
}

struct Turn<P: Protocol> {
    question: Question<P>,
    /// What it is asked first.
    doubt: Option<P::Request>,
    /// Not before.
    due: Option<Instant>,
    silent: u8,
}

/// Reads sensors in turn, without end.
pub struct Poll<P: Protocol> {
    turns: Vec<Turn<P>>,
    period: Duration,
    /// The one that is being read.
    current: Option<usize>,
    /// Whose turn it was last.
    last: usize,
    is_over: bool,
}

impl<P: Measures> Poll<P> {
    /// Reads each of them once in `period`; as often as the bus allows if that is zero.
    pub fn new(questions: impl IntoIterator<Item = Question<P>>, period: Duration) -> Self {
        let turn = |question: Question<P>| {
            let doubt = P::doubt(&question.request);
            Turn { question, doubt, due: None, silent: 0 }
        };
        let turns = questions.into_iter().map(turn).collect();
        Self { turns, period, current: None, last: 0, is_over: false }
    }

    /// The next one that is due, in turn.
    fn choose(&self, now: Instant) -> Option<usize> {
        let count = self.turns.len();
        let in_turn = (1..=count).map(|step| (self.last + step) % count);
        in_turn
            .into_iter()
            .find(|&index| self.turns.get(index).is_some_and(|turn| turn.due.is_none_or(|due| due <= now)))
    }
}

impl<P: Measures> Operation for Poll<P> {
    type Protocol = P;
    type Event = Polled;
    type Report = ();
    type Error = Infallible;

    fn next(&mut self, now: Instant) -> StepOf<Self> {
        if self.is_over {
            return Step::Done;
        }
        self.current = self.current.or_else(|| self.choose(now));
        match self.current.and_then(|index| self.turns.get(index)) {
            Some(Turn { question: Question { address, request }, doubt, .. }) => {
                Step::Ask { address: *address, request: doubt.unwrap_or(*request), tries: TRIES }
            }
            None => {
                let due = self.turns.iter().filter_map(|turn| turn.due).min();
                Step::Wait { until: due.unwrap_or(now + SELDOM) }
            }
        }
    }

    fn result(&self) -> Option<Result<(), Infallible>> {
        self.is_over.then_some(Ok(()))
    }

    fn on(&mut self, outcome: &ExchangeOutcome<P>) -> Option<Polled> {
        let sensor = self.current.take()?;
        self.last = sensor;
        let turn = self.turns.get_mut(sensor)?;
        let result = match &outcome.result {
            Ok(answer) if turn.doubt.is_some() => match P::is_believed(&turn.question.request, answer) {
                // It is due still.
                Ok(()) => {
                    turn.doubt = None;
                    return None;
                }
                Err(status) => Err(status),
            },
            Ok(answer) => P::measured(answer),
            Err(Fault::NoAnswer { .. }) => Err(Status::NoAnswer),
            Err(Fault::Garbled { .. }) => Err(Status::BadAnswer),
            Err(Fault::Bad(error)) => Err(P::refused(error)),
            Err(Fault::NotSent | Fault::LineBusy | Fault::Contention | Fault::Over { .. }) => {
                Err(Status::NotSent)
            }
        };
        if result == Err(Status::NoAnswer) {
            turn.silent = turn.silent.saturating_add(1);
            turn.doubt = P::doubt(&turn.question.request);
        } else {
            turn.silent = 0;
        }
        let now = outcome.at;
        turn.due = Some(if turn.silent >= SILENT {
            now + self.period.longer(SELDOM)
        } else {
            // In step, unless the bus does not keep up.
            turn.due.map_or(now, |due| due) + self.period
        });
        if turn.due.is_some_and(|due| due < now) {
            turn.due = Some(now);
        }
        Some(Polled { sensor, result })
    }

    fn progress(&self) -> TaskProgress {
        TaskProgress { done: 0, of: 0 }
    }

    fn cancel(&mut self) {
        self.is_over = true;
    }
}
