//! Adaptive timeout: how much longer than its document allows the master waits for a sensor on this bus.
//!
//! Without it, a sensor that is a little too slow would miss each deadline and disturb each next exchange. The wait
//! grows with the lateness seen, up to [`Timing::extension`](crate::Timing), and shrinks to what the last [`WINDOW`]
//! requests needed, because each dead node costs a whole wait.

use crate::{Duration, Timing};

/// Requests after which the extension shrinks to what they needed.
const WINDOW: u16 = 1_000;

#[derive(Default)]
pub(super) struct AdaptiveTimeout {
    granted: Duration,
    needed: Duration,
    requests: u16,
}

impl AdaptiveTimeout {
    /// The time to add to a wait.
    pub fn extension(&self) -> Duration {
        self.granted
    }

    /// One more request.
    pub fn count(&mut self) {
        self.requests = self.requests.saturating_add(1);
        if self.requests >= WINDOW {
            self.granted = self.needed;
            (self.needed, self.requests) = (Duration::ZERO, 0);
        }
    }

    /// An answer began `over` after the document's limit. Ignored if the longest extension is too short for it.
    pub fn note(&mut self, over: Duration, timing: &Timing) {
        if over == Duration::ZERO {
            return;
        }
        let needed = over + timing.margin;
        if needed <= timing.extension {
            self.needed = self.needed.max(needed);
            self.granted = self.granted.max(needed);
        }
    }
}
