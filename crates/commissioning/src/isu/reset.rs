//! Reset, "the equivalent of a power-on reset" (appendix A, function 001), and waiting for the module to come back.

use clino_bus::{ExchangeOutcome, Instant, Isu};

use super::boot::{Alive, Boot};
use super::talk::Talk;
use super::{Cause, Failure, Module};
use crate::{Operation, Step, StepOf, TaskProgress};

/// Resets a module. One in its Hard Error state is taken out of it first: it would not listen.
#[derive(Clone, Copy, Debug)]
pub struct Reset {
    talk: Talk,
    boot: Boot,
    ended: Option<Result<Alive, Cause>>,
}

impl Reset {
    /// Begins with the reset.
    pub const fn new(module: Module) -> Reset {
        let at = module.address();
        Reset { talk: Talk::new(at), boot: Boot::new(at, None), ended: None }
    }
}

impl Operation for Reset {
    type Protocol = Isu;
    type Event = core::convert::Infallible;
    type Report = Alive;
    type Error = Failure;

    fn next(&mut self, now: Instant) -> StepOf<Self> {
        match self.ended {
            None => self.boot.next(&self.talk, now),
            Some(_) => Step::Done,
        }
    }

    fn result(&self) -> Option<Result<Self::Report, Self::Error>> {
        self.ended.map(|result| result.map_err(|cause| Failure { cause, writes: 0, repair: false }))
    }

    fn on(&mut self, outcome: &ExchangeOutcome<Isu>) -> Option<Self::Event> {
        self.ended = self.ended.or(self.boot.on(&mut self.talk, outcome));
        None
    }

    fn progress(&self) -> TaskProgress {
        TaskProgress::new(u16::from(self.ended.is_some()), 1)
    }

    fn cancel(&mut self) {
        self.ended.get_or_insert(Err(Cause::Cancelled));
    }
}
