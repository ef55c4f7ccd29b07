//! How much longer than its document allows a sensor on this bus takes.
//!
//! A sensor that is a little slow would be asked, given up, and then talk into the next exchange, for ever. So the wait
//! grows with what was seen, up to [`Timing::slack`](crate::Timing), and shrinks again to what the last
//! [`WINDOW`] requests needed: silence is expensive when other nodes are dead.

use crate::{Micros, Timing};

/// Requests after which what is not needed any more is forgotten.
const WINDOW: u16 = 1_000;

#[derive(Default)]
pub(super) struct Slack {
    granted: Micros,
    needed: Micros,
    requests: u16,
}

impl Slack {
    /// To be added to a wait.
    pub fn granted(&self) -> Micros {
        self.granted
    }

    /// One more request.
    pub fn count(&mut self) {
        self.requests = self.requests.saturating_add(1);
        if self.requests >= WINDOW {
            self.granted = self.needed;
            (self.needed, self.requests) = (Micros::ZERO, 0);
        }
    }

    /// An answer began `over` after the document's limit. One that no slack can catch counts for nothing.
    pub fn note(&mut self, over: Micros, timing: &Timing) {
        if over == Micros::ZERO {
            return;
        }
        let needed = over + timing.margin;
        if needed <= timing.slack {
            self.needed = self.needed.max(needed);
            self.granted = self.granted.max(needed);
        }
    }
}
