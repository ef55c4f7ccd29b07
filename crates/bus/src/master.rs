//! One request, one answer, one deadline.
//!
//! ```text
//!        begin           Released           first character late, gap too long
//!  Idle ───────▶ Sending ────────▶ Waiting ─────────────────────────────────▶ Quiet ──▶ Idle
//!    ▲                                │ answer                                  │ (late answers are
//!    └────────────────────────────────┴─────────────────────────────────────────┘  counted, never used)
//! ```
//!
//! *Waiting.* The first character has to come within the sensor's documented latency; a dead node costs no more. A
//! character never shortens a wait, so stray characters at turnaround cost nothing; length and checksum make the frame, a gap
//! only ends the wait. However long a node babbles, a wait ends after the longest answer twice over.
//!
//! *Quiet.* After a failure the master sends nothing for [`Timing::quiet`], and for longer if the node usually answers
//! (`master/history.rs`). After that the master may be asked what cannot be confused with the request that failed
//! ([`Master::may_ask`]): another node, another command. For the same again it is idle only when no late answer can come
//! any more, [`Timing::late`] after the deadline (`master/late.rs`). So dead nodes are cheap, and a late answer to one
//! request is never the answer to the next, be it the same request to the same node. A caller that does not need this
//! efficiency waits for [`Master::is_idle`].
//!
//! *Slow nodes.* Answers seen to be late prolong the waits, up to [`Timing::extension`] (`master/adaptive.rs`).

use clino_codec::DecodeProgress;

use crate::counters::{BusCounters, bump};
pub use crate::line::Event;
use crate::protocol::Protocol;
use crate::{Duration, Instant, Timing};

mod adaptive;
mod begin;
mod end;
mod exchange;
mod fault;
mod hear;
mod history;
mod late;

use adaptive::AdaptiveTimeout;
use exchange::Exchange;
pub use fault::{Blame, Fault};
use history::NodeHistory;
use late::OutstandingReplies;

/// No wait is stretched by more than this many characters, or by twice the answer, if that is more. It is twice the
/// T7's 34-byte answer, so that a frame still arrives whole after as many stray characters.
pub const LONGEST_ANSWER: u32 = 68;

/// How an exchange ended.
#[derive(Debug)]
pub struct ExchangeOutcome<P: Protocol> {
    /// The answer, or why there is none.
    pub result: Result<P::Answer, Fault<P::DecodeError>>,
    /// When it ended: the stop bit of the answer's last character, or the deadline.
    pub at: Instant,
}

/// Where the exchange in hand is.
#[derive(Clone, Copy)]
enum State {
    Idle,
    Sending {
        give_up: Instant,
    },
    Waiting {
        deadline: Instant,
        give_up: Instant,
    },
    Quiet {
        /// No request before this.
        clear: Instant,
        give_up: Instant,
        /// A late answer may begin until then; `None` when there is none to come.
        outstanding: Option<Instant>,
    },
}

/// Master of one bus that speaks `P`. Frames go out through a [`Line`](crate::Line), whose events come in here.
pub struct Master<P: Protocol> {
    timing: Timing,
    /// One character: a division that is not done for each one that comes in.
    character: Duration,
    state: State,
    /// The exchange in hand, or the last one: it is taken up again for the next, which is cheaper than a new one.
    exchange: Option<Exchange<P>>,
    outstanding: OutstandingReplies<P>,
    history: NodeHistory,
    adaptive: AdaptiveTimeout,
    counters: BusCounters,
    /// The node of the last late answer, until [`Master::take_late`].
    late_node: Option<u8>,
}

impl<P: Protocol> Master<P> {
    /// A master with nothing in hand. Inlined, for it is large: so it is made where it is to stay.
    #[inline(always)]
    pub fn new(timing: Timing) -> Self {
        Master {
            timing,
            character: timing.serial.characters(1),
            state: State::Idle,
            exchange: None,
            outstanding: OutstandingReplies::new(),
            history: NodeHistory::default(),
            adaptive: AdaptiveTimeout::default(),
            counters: BusCounters::default(),
            late_node: None,
        }
    }

    /// The node whose answer came late, once for each. To be called at least once for each request.
    pub fn take_late(&mut self) -> Option<u8> {
        self.late_node.take()
    }

    /// Whether nothing is in hand, and no late answer to the last request can come any more.
    pub fn is_idle(&self) -> bool {
        matches!(self.state, State::Idle)
    }

    /// Whether an exchange is in hand.
    pub fn is_asking(&self) -> bool {
        matches!(self.state, State::Sending { .. } | State::Waiting { .. })
    }

    /// What happened since reset.
    pub fn counters(&self) -> &BusCounters {
        &self.counters
    }

    /// Sets what was counted to zero.
    pub fn clear_counters(&mut self) {
        self.counters = BusCounters::default();
    }

    /// The waits in force.
    pub fn timing(&self) -> &Timing {
        &self.timing
    }

    /// Changes the waits, for a bus whose bit rate has changed. Takes effect with the next exchange; not to be called
    /// during one.
    pub fn set_timing(&mut self, timing: Timing) {
        self.timing = timing;
        self.character = timing.serial.characters(1);
    }

    /// Takes an event of the line. A collecting exchange has more than one outcome.
    pub fn on(&mut self, event: Event) -> Option<ExchangeOutcome<P>> {
        match event {
            Event::Released { at } => self.released(at),
            Event::Forced { at } => {
                bump(&mut self.counters.forced);
                return self.not_sent(Fault::NotSent, at);
            }
            Event::GivenUp { at } => {
                bump(&mut self.counters.line_busy);
                return self.not_sent(Fault::LineBusy, at);
            }
            Event::Heard { character, at } => return self.heard(character, at),
            Event::Echo { .. } => bump(&mut self.counters.echo),
            Event::Contention { .. } => self.contended(),
        }
        None
    }

    /// Lets time pass. To be called again while it returns an outcome.
    pub fn poll(&mut self, now: Instant) -> Option<ExchangeOutcome<P>> {
        match self.state {
            State::Sending { give_up } if now >= give_up => self.fail(Fault::NotSent, now),
            State::Waiting { deadline, .. } if now >= deadline => {
                // What the decoder has held back until now; each report takes at least a character, so this ends.
                while let (State::Waiting { .. }, Some(exchange)) = (self.state, &mut self.exchange) {
                    let (progress, last) = (P::idle(&mut exchange.decoder), exchange.last);
                    if matches!(progress, DecodeProgress::More) {
                        return self.missed(deadline, now);
                    }
                    let outcome = self.progressed(progress, last);
                    if outcome.is_some() {
                        return outcome;
                    }
                }
                None
            }
            State::Quiet { clear, outstanding, .. }
                if now >= outstanding.map_or(clear, |until| until.max(clear)) =>
            {
                self.leave_quiet(now);
                None
            }
            _ => None,
        }
    }

    /// When [`Master::poll`] has something to do, if ever.
    pub fn poll_at(&self) -> Option<Instant> {
        match self.state {
            State::Idle => None,
            State::Sending { give_up } => Some(give_up),
            State::Waiting { deadline, .. } => Some(deadline),
            State::Quiet { clear, outstanding, .. } => {
                Some(outstanding.map_or(clear, |until| until.max(clear)))
            }
        }
    }
}

#[cfg(test)]
mod tests;
