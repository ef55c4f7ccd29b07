//! How an exchange begins, and when it may.

use super::exchange::{Collecting, Exchange};
use super::{Engine, Rest, State};
use crate::counters::bump;
use crate::{Duration, ExpectedReply, Instant};

/// What kind of exchange begins.
#[derive(Clone, Copy)]
pub(crate) enum Kind {
    /// The first try.
    First,
    /// Another try.
    Retry,
    /// One that any number of nodes may answer for this long.
    Collecting(Duration),
}

/// A request that is to be sent.
pub(crate) struct Opening {
    pub expected: ExpectedReply,
    pub kind: Kind,
    /// It changes the sensor's non-volatile memory.
    pub writes: bool,
    /// Characters of its frame.
    pub characters: usize,
}

impl Engine {
    /// No request may be asked before this: the line is not quiet yet after the last exchange. [`Instant::ZERO`] if it is.
    pub fn clear_at(&self) -> Instant {
        match self.state {
            State::Quiet { clear, .. } => clear,
            _ => Instant::ZERO,
        }
    }

    /// From when on a request that calls for this answer may be asked: see [`Master::ask_at`](crate::Master::ask_at).
    pub fn ask_at(&self, expected: &ExpectedReply) -> Option<Instant> {
        let on_the_list = self.outstanding.clear_at(expected);
        match self.state {
            State::Idle => Some(on_the_list),
            State::Sending { .. } | State::Waiting { .. } => None,
            State::Quiet { clear, outstanding, .. } => {
                let confusable = expected.is_confusable_with(&self.exchange.expected);
                let last = outstanding.filter(|_| confusable).unwrap_or(Instant::ZERO);
                Some(on_the_list.max(clear).max(last))
            }
        }
    }

    /// The node that was just asked may take so long to begin its answer, whatever its document says. To be called
    /// before its request is out.
    pub(crate) fn allow(&mut self, latency: Duration) {
        if let State::Sending { .. } = self.state {
            self.exchange.latency = latency;
        }
    }

    /// An exchange begins. `rest` is what the decoder held of one that is in its quiet time.
    #[inline(never)]
    pub(crate) fn begin(&mut self, opening: &Opening, rest: Rest, now: Instant) {
        let &Opening { expected, kind, writes, characters } = opening;
        self.leave(rest, now);
        self.adaptive.count();
        bump(&mut self.counters.requests);
        if writes {
            bump(&mut self.counters.writes);
        }
        let retry = matches!(kind, Kind::Retry);
        if retry {
            bump(&mut self.counters.retries);
        }
        let collecting = match kind {
            Kind::Collecting(window) => Some(Collecting::new(window)),
            _ => None,
        };
        let latency = if writes { self.timing.set_latency } else { self.timing.get_latency };
        let (asked, released, first, last) = (now, now, now, now);
        self.exchange =
            Exchange { expected, latency, asked, released, first, last, retry, collecting, ..Exchange::NONE };
        // The line reports how the frame ended; this deadline, twice what it may take, covers one that does not.
        let longest = self.timing.line_busy + self.character.times(characters as u32);
        self.state = State::Sending { give_up: now + longest.times(2) };
    }

    /// Leaves the state at hand for a new exchange.
    fn leave(&mut self, rest: Rest, now: Instant) {
        if self.is_asking() {
            let until = now + self.exchange.latency + self.timing.late;
            self.outstanding.add(self.exchange.outstanding(until), now);
        }
        self.leave_quiet(rest, now);
    }
}
