//! Carrying out a plan: for each run of words read, compare, write only a difference, read back.
//!
//! A run is written only after each of its words has read either as planned from or as planned to: what the image said
//! is confirmed by a second reading. Once it has been written, whatever else it reads is what a damaged command left,
//! and it is written again.

use clino_bus::{ExchangeOutcome, Isu};
use clino_codec::isu::eeprom::{Plan, PlannedWrite};
use clino_codec::isu::{Function, Request, Response, Words};

use super::Cause;
use super::talk::{Said, Talk};
use crate::{READ_TRIES, WRITE_TRIES};

/// Carries out a plan.
#[derive(Clone, Copy, Debug)]
pub(super) struct Writer {
    plan: Plan,
    /// Which of the plan's writes.
    index: usize,
    writing: bool,
    /// Writes of this run so far.
    tries: u8,
    /// The last reading of the first run showed it untouched.
    untouched: bool,
}

impl Writer {
    pub const fn new(plan: Plan) -> Writer {
        Writer { plan, index: 0, writing: false, tries: 0, untouched: true }
    }

    fn run(&self) -> Option<&PlannedWrite> {
        self.plan.writes().get(self.index)
    }

    /// What to ask next, and how often; `None` when everything reads as planned.
    pub fn request(&self) -> Option<(Request, u8)> {
        self.run().map(|run| if self.writing { (run.request(), 1) } else { (run.read_back(), READ_TRIES) })
    }

    /// Whether everything reads as planned.
    pub fn is_done(&self) -> bool {
        self.run().is_none()
    }

    /// An exchange begun with [`request`](Self::request) has ended. `true` when a write was sent, with any outcome.
    pub fn on(&mut self, talk: &mut Talk, outcome: &ExchangeOutcome<Isu>) -> Result<bool, Cause> {
        if self.writing && !talk.is_softening() {
            talk.settle_write(outcome);
            self.writing = false;
            self.tries = self.tries.saturating_add(1);
            self.untouched = false;
            return Ok(true);
        }
        match talk.settle(Function::ReadEeprom, outcome) {
            Said::Response(Response::ReadEeprom { words, .. }) => self.read(words)?,
            Said::Response(_) | Said::Again => {}
            Said::Failed(cause) => return Err(cause),
        }
        Ok(false)
    }

    /// Whether some of the words may have been written, but not all.
    pub fn is_torn(&self) -> bool {
        !self.untouched && self.run().is_some()
    }

    /// Runs done, and all of them.
    pub fn progress(&self) -> (u16, u16) {
        (self.index as u16, self.plan.writes().len() as u16)
    }

    /// What the words of the run are now.
    fn read(&mut self, seen: &Words) -> Result<(), Cause> {
        let Some(run) = self.run() else { return Ok(()) };
        let mut differs = None;
        let mut as_before = true;
        let pairs = run.before().iter().zip(run.words());
        for (word, ((&before, &wanted), seen)) in (run.start()..).zip(pairs.zip(seen.iter())) {
            if seen != before && seen != wanted && self.tries == 0 {
                return Err(Cause::Mismatch { word, before, wanted, seen });
            }
            if seen != wanted {
                differs = Some(Cause::NotTaken { word, wanted, seen });
            }
            as_before &= seen == before;
        }
        self.untouched = self.index == 0 && as_before;
        match differs {
            None => {
                self.index = self.index.saturating_add(1);
                self.tries = 0;
                self.untouched = false;
            }
            Some(cause) if self.tries >= WRITE_TRIES => return Err(cause),
            Some(_) => self.writing = true,
        }
        Ok(())
    }
}
