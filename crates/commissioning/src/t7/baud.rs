//! Changing a device's bit rate, and following it.
//!
//! ```text
//!  Present ──▶ Write ──▶ (20 ms) ──▶ new rate: Look ── answers ──▶ done, the line stays there
//!                 ▲                    │ ▲
//!                 │                    ▼ │ silent; each time after 550 ms
//!                 └── answers ──── old rate: Look ── silent twice at both ──▶ lost, the line stays at the old rate
//! ```
//! The device answers at the old rate and changes about 10 ms after (section 2.7.2). Other devices stay at their rate:
//! on a shared line, change them all. Source: T7 guide sections 1, 2.7.2.

use clino_bus::{ExchangeOutcome, Instant, Protocol, Serial, T7};
use clino_codec::t7::{BaudRate, EncodeError, Opcode, Request, Response, Status};

use super::set::refusal;
use super::{BAUD_CHANGE, Cause, Device, Failure, Fault, RESYNC};
use crate::{Operation, READ_TRIES, Report, Step, StepOf, TaskProgress, WRITE_TRIES};

/// How often a silent device is looked for, at the new and the old rate in turn.
const LOOKS: u8 = 4;

/// Gives a device another bit rate.
#[derive(Clone, Copy, Debug)]
pub struct ChangeBaud {
    device: Device,
    from: BaudRate,
    to: BaudRate,
    /// What the line runs at.
    line: BaudRate,
    state: State,
    refused: Option<Status>,
    writes: u8,
    cancelled: bool,
}

#[derive(Clone, Copy, Debug)]
enum State {
    Present,
    Write,
    /// Looks for it at `rate`, not before `from`.
    Look {
        rate: BaudRate,
        from: Instant,
        looks: u8,
    },
    Ended(Result<Report<BaudRate>, Failure>),
}

impl ChangeBaud {
    /// From `from`, at which the line runs now, to `to`.
    ///
    /// # Errors
    /// None that is known: every device may be asked this.
    pub fn new(device: Device, from: BaudRate, to: BaudRate) -> Result<ChangeBaud, EncodeError> {
        T7::encode(device.address(), &Request::SetBaudRate(to))?;
        T7::encode(device.address(), &LOOK)?;
        Ok(ChangeBaud {
            device,
            from,
            to,
            line: from,
            state: State::Present,
            refused: None,
            writes: 0,
            cancelled: false,
        })
    }

    #[inline(never)]
    fn end(&mut self, cause: Cause) {
        self.state = State::Ended(Err(Failure { cause, writes: self.writes }));
    }

    fn found_at(&mut self, rate: BaudRate) {
        if rate == self.to {
            self.state = State::Ended(Ok(Report::new(self.from, self.to, self.writes)));
        } else if let Some(status) = self.refused {
            self.end(Cause::Status { opcode: Opcode::SetBaudRate, status });
        } else if self.cancelled {
            self.end(Cause::Cancelled);
        } else if self.writes >= WRITE_TRIES {
            self.end(Cause::StillAtRate { rate });
        } else {
            self.state = State::Write;
        }
    }

    fn silent_at(&mut self, rate: BaudRate, looks: u8, fault: Fault, at: Instant) {
        let looks = looks.saturating_add(1);
        if looks >= LOOKS {
            self.end(Cause::Lost { fault });
        } else {
            // If it is at the other rate, it has half a command in its receiver now.
            let rate = if rate == self.to { self.from } else { self.to };
            self.state = State::Look { rate, from: at + RESYNC, looks };
        }
    }
}

/// The request used to find a device: short, and valid for every device.
const LOOK: Request = Request::GetDamping;

impl Operation for ChangeBaud {
    type Protocol = T7;
    type Event = core::convert::Infallible;
    type Report = Report<BaudRate>;
    type Error = Failure;

    fn next(&mut self, now: Instant) -> StepOf<Self> {
        if self.cancelled && self.writes == 0 && !matches!(self.state, State::Ended(_)) {
            self.end(Cause::Cancelled);
        }
        // The rate that the state needs: after the end, the one at which the device was found.
        let rate = match self.state {
            State::Present | State::Write => self.from,
            State::Look { from, .. } if now < from => return Step::Wait { until: from },
            State::Look { rate, .. } => rate,
            State::Ended(Ok(_)) => self.to,
            State::Ended(Err(_)) => self.from,
        };
        if self.line != rate {
            self.line = rate;
            return Step::Serial(Serial { baud: rate.bits_per_second() });
        }
        let address = self.device.address();
        match self.state {
            State::Present | State::Look { .. } => Step::Ask { address, request: LOOK, tries: READ_TRIES },
            State::Write => Step::Ask { address, request: Request::SetBaudRate(self.to), tries: 1 },
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
        let is_damping = |response: &Response| matches!(response, Response::GetDamping { .. });
        match (&self.state, &outcome.result) {
            (State::Present, Ok(answer)) if is_damping(&answer.response) => {
                if self.from == self.to {
                    self.found_at(self.to)
                } else {
                    self.state = State::Write
                }
            }
            (State::Present, Err(fault)) => {
                let address = self.device.address();
                self.end(Cause::NoAnswer { opcode: LOOK.opcode(), address, fault: *fault });
            }
            (State::Write, result) => {
                self.writes = self.writes.saturating_add(1);
                self.refused = result.as_ref().ok().and_then(|answer| refusal(&answer.response));
                // One that refuses stays; one that was not understood has probably gone.
                let rate = if self.refused.is_some() { self.from } else { self.to };
                self.state = State::Look { rate, from: outcome.at + BAUD_CHANGE, looks: 0 };
            }
            (&State::Look { rate, .. }, Ok(answer)) if is_damping(&answer.response) => self.found_at(rate),
            (&State::Look { rate, looks, .. }, &Err(fault)) => {
                self.silent_at(rate, looks, fault, outcome.at);
            }
            _ => {}
        }
        None
    }

    fn progress(&self) -> TaskProgress {
        match self.state {
            State::Present => TaskProgress::new(0, 3),
            State::Write => TaskProgress::new(1, 3),
            State::Look { .. } => TaskProgress::new(2, 3),
            State::Ended(_) => TaskProgress::new(3, 3),
        }
    }

    fn cancel(&mut self) {
        self.cancelled = true;
    }

    fn is_exclusive(&self) -> bool {
        !matches!(self.state, State::Present | State::Ended(_))
    }
}
