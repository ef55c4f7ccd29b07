//! Reset, and waiting until the module answers again.
//!
//! ```text
//!  Reset ── answered ──▶ (100 ms) ──▶ Look ── answers ──▶ alive
//!    ▲ │ not                           ▲ │ not
//!    └─┘ 450 ms                        └─┘ 450 ms, at the other address, for 5 s at most
//! ```

use clino_bus::{Duration, ExchangeOutcome, Instant, Isu};
use clino_codec::isu::{Address, DeviceError, Function, Request, Response};

use super::talk::{Said, Talk};
use super::{BOOT_AGAIN, BOOT_FIRST, BOOT_LIMIT, Cause};
use crate::{READ_TRIES, Step};

/// A module that boots is asked for its reset again in this many rounds. Together with their failed attempts they take
/// about [`BOOT_LIMIT`].
const RESETS: u8 = 3;

/// A module answers after a reset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Alive {
    /// Where it was asked.
    pub at: Address,
    /// It is in its Hard Error state.
    pub hard_error: bool,
    /// How long after the answer to the reset it answered.
    pub after: Duration,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Boot {
    state: State,
    /// Where it is looked for: first here, …
    at: Address,
    /// … then there, in turn.
    other: Option<Address>,
}

#[derive(Clone, Copy, Debug)]
enum State {
    Reset { rounds: u8, from: Instant },
    Look { reset: Instant, from: Instant },
}

impl Boot {
    /// After the reset the module is looked for at `at`, then at `other`.
    pub const fn new(at: Address, other: Option<Address>) -> Boot {
        Boot { state: State::Reset { rounds: 0, from: Instant::ZERO }, at, other }
    }

    /// What to do next.
    pub fn next(&self, talk: &Talk, now: Instant) -> Step<Address, Request> {
        match self.state {
            State::Reset { from, .. } | State::Look { from, .. } if now < from => Step::Wait { until: from },
            State::Reset { .. } => talk.ask(Request::ResetModule, READ_TRIES),
            State::Look { .. } => Step::Ask { address: self.at, request: Request::READ_ANGLE, tries: 1 },
        }
    }

    /// An exchange has ended; `Some` at the end of it all.
    pub fn on(&mut self, talk: &mut Talk, outcome: &ExchangeOutcome<Isu>) -> Option<Result<Alive, Cause>> {
        let at = outcome.at;
        match self.state {
            State::Reset { rounds, .. } => match talk.settle(Function::ResetModule, outcome) {
                Said::Again => None,
                Said::Response(_) => {
                    self.state = State::Look { reset: at, from: at + BOOT_FIRST };
                    None
                }
                Said::Failed(cause) => {
                    // It may have heard, and be booting.
                    let rounds = rounds.saturating_add(1);
                    self.state = State::Reset { rounds, from: at + BOOT_AGAIN };
                    (rounds >= RESETS).then_some(Err(cause))
                }
            },
            State::Look { reset, .. } => {
                let after = at.since(reset);
                let fault = match outcome.result {
                    Ok(answer) => {
                        let hard_error =
                            matches!(answer.response, Response::Error(DeviceError::HardwareError { .. }));
                        return Some(Ok(Alive { at: self.at, hard_error, after }));
                    }
                    Err(fault) => fault,
                };
                if let Some(other) = self.other {
                    self.other = Some(self.at);
                    self.at = other;
                }
                self.state = State::Look { reset, from: at + BOOT_AGAIN };
                (after >= BOOT_LIMIT).then_some(Err(Cause::NotBooted { fault }))
            }
        }
    }
}
