//! The phases of one exchange, whatever its protocol: one copy for all of them.

use clino_bus::{Duration, Engine, ExpectedReply, Fault, Instant};
use clino_codec::checks::Check;

use super::link::Link;

/// More unsolicited characters than this are not left over in a receive buffer, but come from a node that does
/// not stop transmitting. Our choice: larger than the usual buffers.
const MOST_STALE: u32 = 1_024;

/// What is to be done.
pub enum Todo {
    /// Listen for this long.
    Listen(Duration),
    /// Begin the exchange, and send.
    Send,
    /// Nothing: no exchange is in hand, and so nothing comes.
    Nothing,
}

/// What a character, or time that has passed, means.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Means {
    /// Nothing yet.
    Nothing,
    /// The rest of the span is of no interest.
    Enough,
    /// If the master has an outcome, it is one of this exchange.
    Outcome,
    /// The line does not fall silent: the request ends before it is sent.
    GivenUp,
}

/// Where an exchange is.
pub struct Phases {
    /// The answer that the request calls for.
    expected: ExpectedReply,
    /// The request changes the sensor's non-volatile memory.
    writes: bool,
    /// Tries that failed.
    pub tried: u8,
    /// The next one not before this.
    next: Instant,
    phase: Phase,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// What was before still has its effects. What is heard may be a late answer.
    Settling {
        /// Until then, a sensor may take what we send for the end of a frame that was cut.
        recovered_at: Option<Instant>,
    },
    /// The line has to be silent. What is heard is left over from before.
    Guarding {
        /// The request has to be sent by then.
        give_up: Instant,
        /// Characters heard.
        stale: u32,
        silence: Silence,
    },
    /// The frame is on its way, or the answer.
    Waiting,
    /// One of several answers is here.
    Partly,
    Over,
}

impl Phase {
    const SETTLING: Self = Self::Settling { recovered_at: None };
}

/// What is known of the present span of the guard.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Silence {
    Unknown,
    Broken,
    Kept,
}

impl Phases {
    /// Those of a request that calls for this answer.
    pub fn new(expected: ExpectedReply, writes: bool) -> Self {
        Self { expected, writes, tried: 0, next: Instant::ZERO, phase: Phase::SETTLING }
    }

    /// What to do next.
    pub fn next(&mut self, link: &mut Link, engine: &Engine) -> Todo {
        if let Phase::Settling { .. } = self.phase {
            match self.settled_at(link, engine) {
                Some(at) if at > link.now => return Todo::Listen(link.until(at)),
                _ => {
                    let give_up = link.now + engine.timing().line_busy;
                    self.phase = Phase::Guarding { give_up, stale: 0, silence: Silence::Unknown };
                }
            }
        }
        match self.phase {
            Phase::Guarding { silence: Silence::Kept, .. } => {
                self.phase = Phase::Waiting;
                Todo::Send
            }
            Phase::Waiting => match engine.poll_at() {
                Some(deadline) => Todo::Listen(link.until(deadline)),
                None => Todo::Nothing,
            },
            _ => Todo::Listen(engine.timing().guard),
        }
    }

    /// From when on the request may be sent.
    fn settled_at(&mut self, link: &mut Link, engine: &Engine) -> Option<Instant> {
        if link.half_sent
            && let Phase::Settling { recovered_at } = &mut self.phase
        {
            let at = *recovered_at.get_or_insert(link.now + link.command_timeout);
            if at > link.now {
                return Some(at);
            }
            link.half_sent = false;
        }
        // An exchange that was dropped is still in hand: it has a deadline.
        let clear = engine.ask_at(&self.expected);
        clear.map(|clear| clear.max(self.next)).or_else(|| engine.poll_at())
    }

    /// A character came, which proves that this time has passed; `has_outcome` if it has ended an exchange.
    pub fn heard(&mut self, link: &mut Link, engine: &Engine, has_outcome: bool, proven: Instant) -> Means {
        let means = match &mut self.phase {
            Phase::Settling { .. } => {
                let is_settled = self.settled_at(link, engine).is_none_or(|at| at <= proven);
                if is_settled { Means::Enough } else { Means::Nothing }
            }
            Phase::Guarding { stale, silence, .. } => {
                *silence = Silence::Broken;
                *stale = stale.saturating_add(1);
                if *stale > MOST_STALE { Means::GivenUp } else { Means::Nothing }
            }
            Phase::Waiting if has_outcome => Means::Outcome,
            Phase::Waiting => Means::Nothing,
            Phase::Partly | Phase::Over => Means::Enough,
        };
        if means != Means::Nothing {
            link.now = link.now.max(proven);
        }
        means
    }

    /// The span that was listened to has passed.
    pub fn passed(&mut self, now: Instant) -> Means {
        match &mut self.phase {
            Phase::Settling { .. } | Phase::Partly | Phase::Over => Means::Nothing,
            Phase::Guarding { silence: silence @ Silence::Unknown, .. } => {
                *silence = Silence::Kept;
                Means::Nothing
            }
            Phase::Guarding { silence, give_up, .. } => {
                *silence = Silence::Unknown;
                if now >= *give_up { Means::GivenUp } else { Means::Nothing }
            }
            Phase::Waiting => Means::Outcome,
        }
    }

    /// There is an outcome: the last one, or one of several.
    pub fn ended(&mut self, is_last: bool) {
        self.phase = if is_last { Phase::Over } else { Phase::Partly };
    }

    /// The outcome is being handed over. Returns whether it is the last.
    pub fn hand_over(&mut self) -> bool {
        let is_last = self.phase == Phase::Over;
        if !is_last {
            self.phase = Phase::Waiting;
        }
        is_last
    }

    /// The exchange has ended with this fault: returns whether it begins again.
    pub fn begins_again(&mut self, link: &Link, fault: &Fault<Check>, at: Instant) -> bool {
        let tried = self.tried.saturating_add(1);
        let Some(next) = link.retry.after(tried, self.writes, fault, at) else { return false };
        (self.tried, self.next, self.phase) = (tried, next, Phase::SETTLING);
        true
    }
}
