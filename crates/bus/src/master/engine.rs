//! The exchange in hand and what the bus remembers of those before, whatever its protocol: one copy for all of them.
//!
//! The engine has the times, the counters and the outstanding replies. The [`Master`](crate::Master) around it has the
//! decoder, and tells what comes out of it by its [`ReplyHeader`](crate::ReplyHeader) or the check that failed.

use crate::counters::{BusCounters, bump};
use crate::{Duration, ExpectedReply, Instant, Timing};

mod adaptive;
mod begin;
mod end;
mod exchange;
mod hear;
#[cfg_attr(not(feature = "many-nodes"), path = "engine/no_history.rs")]
mod history;
mod late;

use adaptive::AdaptiveTimeout;
pub use begin::ExchangeKind;
pub(crate) use begin::Opening;
use end::End;
pub(crate) use end::Missed;
use exchange::Exchange;
pub(crate) use hear::{Framed, Refused};
use history::NodeHistory;
use late::OutstandingReplies;

/// Where the exchange in hand is.
#[derive(Clone, Copy, PartialEq, Eq)]
enum State {
    Idle,
    Sending,
    Waiting,
    Quiet,
}

/// What came out of a decoder when its time was over.
#[derive(Clone, Copy, Default)]
pub(crate) struct Rest {
    /// Good frames.
    pub frames: u32,
    /// Characters that belonged to no frame, from the beginning.
    pub discarded: u32,
}

/// What time has brought.
pub(crate) enum Due {
    Nothing,
    /// The line never said how our frame ended: the exchange has failed.
    NotSent,
    /// The deadline of the answer has passed.
    Answer,
    /// The quiet time is over.
    Clear,
}

/// The part of a [`Master`](crate::Master) that is the same for all protocols; what it has counted, its waits, and when what
/// may be asked.
pub struct Engine {
    timing: Timing,
    /// One character: a division that is not done for each one that comes in.
    character: Duration,
    state: State,
    /// When this state is over: the frame counts as not sent, there is no answer, a request may be asked again.
    due: Instant,
    /// What is heard of an answer puts that off, but not beyond this.
    give_up: Instant,
    /// After a failure a late answer may begin until then: [`Instant::ZERO`] if there is none to come.
    late_until: Instant,
    /// The exchange in hand, or the last one.
    exchange: Exchange,
    outstanding: OutstandingReplies,
    history: NodeHistory,
    adaptive: AdaptiveTimeout,
    counters: BusCounters,
    /// The node of the last late answer, until [`Engine::take_late`].
    late_node: Option<u8>,
}

impl Engine {
    /// Inlined, for it is large: so it is made where it is to stay.
    #[inline(always)]
    pub(crate) fn new(timing: Timing) -> Self {
        Engine {
            timing,
            character: timing.serial.characters(1),
            state: State::Idle,
            due: Instant::ZERO,
            give_up: Instant::ZERO,
            late_until: Instant::ZERO,
            exchange: Exchange::NONE,
            outstanding: OutstandingReplies::new(),
            history: NodeHistory::default(),
            adaptive: AdaptiveTimeout::default(),
            counters: BusCounters::default(),
            late_node: None,
        }
    }

    pub(crate) fn take_late(&mut self) -> Option<u8> {
        self.late_node.take()
    }

    /// As [`Master::is_idle`](crate::Master::is_idle).
    pub fn is_idle(&self) -> bool {
        self.state == State::Idle
    }

    /// As [`Master::is_asking`](crate::Master::is_asking).
    pub fn is_asking(&self) -> bool {
        matches!(self.state, State::Sending | State::Waiting)
    }

    /// Whether a frame of ours is on its way.
    pub(crate) fn is_sending(&self) -> bool {
        self.state == State::Sending
    }

    /// Whether the quiet time after a failure is not over.
    pub(crate) fn is_quiet(&self) -> bool {
        self.state == State::Quiet
    }

    /// Whether the answer is awaited.
    pub(crate) fn is_waiting(&self) -> bool {
        self.state == State::Waiting
    }

    /// What happened since reset.
    pub fn counters(&self) -> &BusCounters {
        &self.counters
    }

    pub(crate) fn clear_counters(&mut self) {
        self.counters = BusCounters::default();
    }

    /// The waits in force.
    pub fn timing(&self) -> &Timing {
        &self.timing
    }

    pub(crate) fn set_timing(&mut self, timing: Timing) {
        self.timing = timing;
        self.character = timing.serial.characters(1);
    }

    /// One character on the line, rounded up.
    pub fn character(&self) -> Duration {
        self.character
    }

    /// The answer that the exchange in hand, or the last one, calls for.
    pub fn expected(&self) -> &ExpectedReply {
        &self.exchange.expected
    }

    /// When the last character of the exchange in hand was heard, if one was.
    pub(crate) fn last_heard(&self) -> Instant {
        self.exchange.last
    }

    /// The driver was switched off in the middle of our frame. Returns whether that has ended an exchange.
    pub(crate) fn forced(&mut self, at: Instant) -> bool {
        bump(&mut self.counters.forced);
        self.not_sent(End::Unanswered, at)
    }

    /// Our frame was dropped before its first character. Returns whether that has ended an exchange.
    pub(crate) fn given_up(&mut self, at: Instant) -> bool {
        bump(&mut self.counters.line_busy);
        self.not_sent(End::Unasked, at)
    }

    /// A character of ours came back.
    pub(crate) fn echoed(&mut self) {
        bump(&mut self.counters.echo);
    }

    /// Lets time pass.
    pub(crate) fn poll(&mut self, now: Instant) -> Due {
        if self.poll_at().is_none_or(|at| now < at) {
            return Due::Nothing;
        }
        match self.state {
            State::Idle => Due::Nothing,
            State::Sending => {
                self.fail(End::Unanswered, now);
                Due::NotSent
            }
            State::Waiting => Due::Answer,
            State::Quiet => Due::Clear,
        }
    }

    /// As [`Master::poll_at`](crate::Master::poll_at).
    pub fn poll_at(&self) -> Option<Instant> {
        match self.state {
            State::Idle => None,
            State::Sending | State::Waiting => Some(self.due),
            State::Quiet => Some(self.due.max(self.late_until)),
        }
    }
}
