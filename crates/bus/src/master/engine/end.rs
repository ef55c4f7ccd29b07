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
        let State::Waiting { deadline, .. } = self.state else { return None };
        let fault = match &mut self.exchange.collecting {
            None => match bad {
                Some(check) if !self.exchange.contended => Fault::Bad(check),
                _ => self.exchange.fault(deadline),
            },
            // What belongs to no frame is reported once, then the sum.
            Some(collecting) if discarded > 0 && !collecting.discarded_reported => {
                collecting.discarded_reported = true;
                bump(&mut collecting.garbled);
                return Some((Fault::Garbled { characters: discarded }, self.exchange.last));
            }
            Some(collecting) => Fault::Over { answers: collecting.answers, garbled: collecting.garbled },
        };
        self.fail(&fault, now);
        Some((fault, now))
    }

    /// Ends the exchange in hand with a fault, and keeps quiet for a while.
    pub(super) fn fail(&mut self, fault: &Fault<Check>, at: Instant) {
        match fault {
            Fault::NoAnswer { .. } => bump(&mut self.counters.no_answer),
            Fault::Garbled { .. } | Fault::Bad(_) => bump(&mut self.counters.bad_answer),
            Fault::NotSent | Fault::LineBusy | Fault::Contention | Fault::Over { .. } => {}
        }
        let outstanding = is_answer_to_come(fault).then(|| at + self.timing.late);
        let clear = at + self.patience(fault);
        let give_up = clear + self.exchange.longest_wait(&self.timing);
        self.state = State::Quiet { clear, give_up, outstanding };
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
        if let State::Quiet { clear, outstanding, .. } = &mut self.state {
            (*clear, *outstanding) = (at, None);
        }
        let late = self.exchange.outstanding(at);
        self.came_late(&late, at);
    }

    /// Nothing more is heard of the exchange that failed; a late answer that may still come goes on the list. `rest` is
    /// what the decoder held.
    #[inline(never)]
    pub(crate) fn leave_quiet(&mut self, rest: Rest, now: Instant) {
        let State::Quiet { mut outstanding, .. } = core::mem::replace(&mut self.state, State::Idle) else {
            return;
        };
        for _ in 0..rest.frames {
            self.note_late(self.exchange.expected.node);
            outstanding = None;
        }
        self.discard(rest);
        if let Some(until) = outstanding.filter(|&until| until > now) {
            self.outstanding.add(self.exchange.outstanding(until), now);
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
