//! How an exchange ends without its answer, and what may come after that.

use clino_codec::checks::Check;

use super::super::Fault;
use super::late::OutstandingReply;
use super::{Engine, Rest, State};
use crate::counters::bump;
use crate::{Duration, Instant};

impl Engine {
    /// The deadline of the exchange in hand has passed, and the decoder holds nothing more: why there is no answer, and
    /// when that was certain. `bad` is the check that refused the last frame, `discarded` how many characters belong to no
    /// frame.
    #[inline(never)]
    pub(crate) fn missed(
        &mut self,
        bad: Option<Check>,
        discarded: u32,
        now: Instant,
    ) -> Option<(Fault<Check>, Instant)> {
        if !self.is_waiting() {
            return None;
        }
        let exchange = &mut self.exchange;
        // What belongs to no frame is reported once, then the sum.
        if exchange.collects && discarded > 0 && !exchange.discarded_reported {
            exchange.discarded_reported = true;
            bump(&mut exchange.garbled);
            return Some((Fault::Garbled { characters: discarded }, exchange.last));
        }
        let fault = match bad {
            _ if exchange.collects => Fault::Over { answers: exchange.answers, garbled: exchange.garbled },
            Some(check) if !exchange.contended => Fault::Bad(check),
            _ => exchange.fault(self.due),
        };
        self.fail(&fault, now);
        Some((fault, now))
    }

    /// Ends the exchange in hand with a fault, and keeps quiet for a while.
    #[inline(never)]
    pub(super) fn fail(&mut self, fault: &Fault<Check>, at: Instant) {
        match fault {
            Fault::NoAnswer { .. } => bump(&mut self.counters.no_answer),
            Fault::Garbled { .. } | Fault::Bad(_) => bump(&mut self.counters.bad_answer),
            Fault::NotSent | Fault::LineBusy | Fault::Contention | Fault::Over { .. } => {}
        }
        self.late_until = if is_answer_to_come(fault) { at + self.timing.late } else { Instant::ZERO };
        let clear = at + self.patience(fault);
        self.enter(State::Quiet, clear);
    }

    /// What lasts until `due`, and longer if something is heard.
    pub(super) fn enter(&mut self, state: State, due: Instant) {
        (self.state, self.due) = (state, due);
        self.give_up = due + self.exchange.longest_wait(&self.timing);
    }

    /// How long the master sends nothing after a failure.
    fn patience(&mut self, fault: &Fault<Check>) -> Duration {
        match fault {
            Fault::NoAnswer { .. } => self.history.missed(self.exchange.expected.node, &self.timing),
            _ => self.timing.quiet,
        }
    }

    /// Our frame did not get out whole. Returns whether that ends an exchange.
    pub(super) fn not_sent(&mut self, fault: &Fault<Check>, at: Instant) -> bool {
        let is_sending = self.is_sending();
        if is_sending {
            self.fail(fault, at);
        }
        is_sending
    }

    /// A late answer was recognised; it ended at `at`.
    pub(super) fn came_late(&mut self, reply: &OutstandingReply, at: Instant) {
        self.note_late(reply.expected.node);
        self.history.late(reply.expected.node);
        self.adaptive.note(reply.lateness(at, self.timing.serial), &self.timing);
    }

    /// The answer to the request that has just failed ended at `at`: no other is to come.
    pub(super) fn came_late_in_quiet(&mut self, at: Instant) {
        (self.due, self.late_until) = (at, Instant::ZERO);
        let late = self.exchange.outstanding(at);
        self.came_late(&late, at);
    }

    /// Nothing more is heard of the exchange that failed; a late answer that may still come goes on the list. `rest` is
    /// what the decoder held.
    #[inline(never)]
    pub(crate) fn leave_quiet(&mut self, rest: Rest, now: Instant) {
        if !self.is_quiet() {
            return;
        }
        self.state = State::Idle;
        for _ in 0..rest.frames {
            self.note_late(self.exchange.expected.node);
            self.late_until = Instant::ZERO;
        }
        self.discard(rest);
        if self.late_until > now {
            self.outstanding.add(self.exchange.outstanding(self.late_until));
        }
    }

    fn note_late(&mut self, node: u8) {
        bump(&mut self.counters.late);
        self.late_node = Some(node);
    }
}

/// Whether the node may still answer the request that ended so. It does not if it was not asked, and not if it has
/// answered already, however badly.
fn is_answer_to_come(fault: &Fault<Check>) -> bool {
    match fault {
        Fault::LineBusy => false,
        Fault::Bad(check) => matches!(check, Check::Address | Check::Command),
        _ => true,
    }
}
