//! How an exchange begins, and when it may.

use super::exchange::Exchange;
use super::{Engine, Rest, State};
use crate::counters::bump;
use crate::{Duration, ExpectedReply, Instant};

/// What kind of exchange begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ExchangeKind {
    /// The first try.
    First,
    /// A repetition of a request that failed.
    Retry,
    /// One that any number of nodes may answer for this long: see [`Master::begin_collecting`](crate::Master::begin_collecting).
    Collecting(Duration),
}

/// A request that is to be sent.
pub(crate) struct Opening {
    pub expected: ExpectedReply,
    pub kind: ExchangeKind,
    /// It changes the sensor's non-volatile memory.
    pub writes: bool,
    /// Characters of its frame.
    pub characters: usize,
}

impl Engine {
    /// No request may be asked before this: the line is not quiet yet after the last exchange. [`Instant::ZERO`] if it is.
    pub fn clear_at(&self) -> Instant {
        match self.state {
            State::Quiet => self.due,
            _ => Instant::ZERO,
        }
    }

    /// From when on a request that calls for this answer may be asked: see [`Master::ask_at`](crate::Master::ask_at).
    pub fn ask_at(&self, expected: &ExpectedReply) -> Option<Instant> {
        let on_the_list = self.outstanding.clear_at(expected);
        match self.state {
            State::Idle => Some(on_the_list),
            State::Sending | State::Waiting => None,
            State::Quiet => {
                let confusable =
                    !cfg!(feature = "many-nodes") || expected.is_confusable_with(&self.exchange.expected);
                let last = if confusable { self.late_until } else { Instant::ZERO };
                Some(on_the_list.max(self.due).max(last))
            }
        }
    }

    /// The node that was just asked may take so long to begin its answer, whatever its document says. To be called
    /// before its request is out.
    pub(crate) fn allow(&mut self, latency: Duration) {
        if self.is_sending() {
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
        let retry = matches!(kind, ExchangeKind::Retry);
        if retry {
            bump(&mut self.counters.retries);
        }
        let (collects, window) = match kind {
            ExchangeKind::Collecting(window) => (true, window),
            _ => (false, Duration::ZERO),
        };
        let latency = if writes { self.timing.set_latency } else { self.timing.get_latency };
        let (asked, released) = (now, now);
        self.exchange =
            Exchange { expected, latency, asked, released, retry, collects, window, ..Exchange::NONE };
        // The line reports how the frame ended; this deadline, twice what it may take, covers one that does not.
        let longest = self.timing.line_busy + self.character.times(characters as u32);
        (self.state, self.due) = (State::Sending, now + longest.times(2));
    }

    /// Leaves the state at hand for a new exchange.
    fn leave(&mut self, rest: Rest, now: Instant) {
        if self.is_asking() {
            let until = now + self.exchange.latency + self.timing.late;
            self.outstanding.add(self.exchange.outstanding(until));
        }
        self.leave_quiet(rest, now);
    }
}
