//! Asking all devices at once (address 126), and reporting everything that comes back.
//!
//! Every T7 answers within 2 ms, so that two on one line overlap: an answer is well-formed or not. Both are reported; a bad
//! one is a suspected collision. Only readings are sent so, and only those whose answers are short enough. Source: T7
//! guide section 1.4.

use clino_bus::{Duration, ExchangeOutcome, Instant, Protocol, Serial, T7, Timing};
use clino_codec::t7::{Address, Answer, Request};

use super::{Cause, Failure, Fault};
use crate::{Operation, Step, StepOf, TaskProgress};

/// Devices on one line (section 1).
const DEVICES: u32 = 32;
/// Longest answer at this address: length value 8 and the two bytes it does not count.
const LONGEST: u32 = 10;

/// Asks all devices one question.
#[derive(Clone, Copy, Debug)]
pub struct AskAll {
    request: Request,
    window: Duration,
    state: State,
}

/// One thing that came back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Heard {
    /// A good answer, with its sender's address.
    Answer(Answer),
    /// Something else: answers of several devices on top of each other, perhaps.
    Collision(#[cfg_attr(feature = "defmt", defmt(Debug2Format))] Fault),
}

/// All that came back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Collected {
    /// Good answers.
    pub answers: u32,
    /// Suspected collisions.
    pub collisions: u32,
}

#[derive(Clone, Copy, Debug)]
enum State {
    Ask,
    Ended(Result<Collected, Cause>),
}

impl AskAll {
    /// Answers may begin until `window` after the request.
    ///
    /// # Errors
    /// [`Cause::Refused`] for a command whose response length value exceeds eight; [`Cause::WritesToAll`] for one that
    /// writes.
    pub fn new(request: Request, window: Duration) -> Result<AskAll, Cause> {
        if request.opcode().is_set() {
            return Err(Cause::WritesToAll { opcode: request.opcode() });
        }
        T7::encode(Address::ALL, &request).map_err(Cause::Refused)?;
        Ok(AskAll { request, window, state: State::Ask })
    }

    /// Time for the answers of 32 devices one after the other, should they wait for each other.
    pub fn window(serial: Serial) -> Duration {
        Timing::t7(serial).get_latency + serial.characters(DEVICES.saturating_mul(LONGEST))
    }
}

impl Operation for AskAll {
    type Protocol = T7;
    type Event = Heard;
    type Report = Collected;
    type Error = Failure;

    fn next(&mut self, _: Instant) -> StepOf<Self> {
        match self.state {
            State::Ask => Step::Collect { address: Address::ALL, request: self.request, window: self.window },
            State::Ended(_) => Step::Done,
        }
    }

    fn result(&self) -> Option<Result<Self::Report, Self::Error>> {
        match self.state {
            State::Ended(result) => Some(result.map_err(|cause| Failure { cause, writes: 0 })),
            State::Ask => None,
        }
    }

    fn on(&mut self, outcome: &ExchangeOutcome<T7>) -> Option<Heard> {
        match outcome.result {
            Ok(answer) => return Some(Heard::Answer(answer)),
            Err(Fault::Over { answers, garbled }) => {
                self.state = State::Ended(Ok(Collected { answers, collisions: garbled }));
            }
            Err(fault @ (Fault::NotSent | Fault::LineBusy)) => {
                let opcode = self.request.opcode();
                self.state = State::Ended(Err(Cause::NoAnswer { opcode, address: Address::ALL, fault }));
            }
            Err(fault) => return Some(Heard::Collision(fault)),
        }
        None
    }

    fn progress(&self) -> TaskProgress {
        TaskProgress::new(u16::from(matches!(self.state, State::Ended(_))), 1)
    }

    fn cancel(&mut self) {
        if matches!(self.state, State::Ask) {
            self.state = State::Ended(Err(Cause::Cancelled));
        }
    }
}
