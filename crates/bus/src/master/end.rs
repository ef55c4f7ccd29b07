//! How an exchange ends without its answer, and what may come after that.

use clino_codec::DecodeProgress;
use clino_codec::checks::Check;

use super::late::OutstandingReply;
use super::{ExchangeOutcome, Fault, Master, State};
use crate::counters::bump;
use crate::{Duration, FailedCheck, Instant, Protocol};

impl<P: Protocol> Master<P> {
    /// The deadline has passed, and the decoder holds nothing more.
    pub(super) fn missed(&mut self, deadline: Instant, now: Instant) -> Option<ExchangeOutcome<P>> {
        let (State::Waiting { .. }, Some(exchange)) = (self.state, &mut self.exchange) else { return None };
        if exchange.collecting.is_none() {
            let fault = exchange.fault(deadline);
            return self.fail(fault, now);
        }
        match exchange.over() {
            over @ Fault::Over { .. } => self.fail(over, now),
            fault => Some(ExchangeOutcome { result: Err(fault), at: exchange.last }),
        }
    }

    /// Ends the exchange in hand with a fault, and keeps quiet for a while.
    pub(super) fn fail(&mut self, fault: Fault<P::DecodeError>, at: Instant) -> Option<ExchangeOutcome<P>> {
        match fault {
            Fault::NoAnswer { .. } => bump(&mut self.counters.no_answer),
            Fault::Garbled { .. } | Fault::Bad(_) => bump(&mut self.counters.bad_answer),
            Fault::NotSent | Fault::LineBusy | Fault::Contention | Fault::Over { .. } => {}
        }
        let outstanding = self.is_answer_to_come(&fault).then(|| at + self.timing.late);
        if !self.is_asking() {
            return None;
        }
        let exchange = self.exchange.as_ref()?;
        let (node, longest) = (P::node(&exchange.expected), exchange.longest_wait(&self.timing));
        let clear = at + self.patience(node, &fault);
        self.state = State::Quiet { clear, give_up: clear + longest, outstanding };
        Some(ExchangeOutcome { result: Err(fault), at })
    }

    /// Whether the node may still answer the request that ended so. It does not if it was not asked, and not if it has
    /// answered already, however badly.
    fn is_answer_to_come(&self, fault: &Fault<P::DecodeError>) -> bool {
        match fault {
            Fault::LineBusy => false,
            Fault::Bad(error) => matches!(error.failed_check(), Check::Address | Check::Command),
            _ => true,
        }
    }

    /// How long the master sends nothing after a failure.
    fn patience(&mut self, node: u8, fault: &Fault<P::DecodeError>) -> Duration {
        match fault {
            Fault::NoAnswer { .. } => self.history.missed(node, &self.timing),
            _ => self.timing.quiet,
        }
    }

    pub(super) fn not_sent(
        &mut self,
        fault: Fault<P::DecodeError>,
        at: Instant,
    ) -> Option<ExchangeOutcome<P>> {
        match self.state {
            State::Sending { .. } => self.fail(fault, at),
            _ => None,
        }
    }

    /// A late answer was recognised; it ended at `at`.
    pub(super) fn came_late(&mut self, reply: &OutstandingReply<P::Expected>, at: Instant) {
        bump(&mut self.counters.late);
        self.late_node = Some(P::node(&reply.expected));
        self.history.late(P::node(&reply.expected));
        self.adaptive.note(reply.lateness::<P>(at, self.timing.serial), &self.timing);
    }

    /// The answer to the request that has just failed ended at `at`: no other is to come.
    pub(super) fn came_late_in_quiet(&mut self, at: Instant) {
        let (State::Quiet { clear, outstanding, .. }, Some(exchange)) = (&mut self.state, &self.exchange)
        else {
            return;
        };
        (*clear, *outstanding) = (at, None);
        let late = exchange.outstanding(at);
        self.came_late(&late, at);
    }

    /// Nothing more is heard of the exchange that failed; a late answer that may still come goes on the list.
    pub(super) fn leave_quiet(&mut self, now: Instant) {
        let State::Quiet { mut outstanding, .. } = core::mem::replace(&mut self.state, State::Idle) else {
            return;
        };
        let Some(exchange) = &mut self.exchange else { return };
        loop {
            match P::idle(&mut exchange.decoder) {
                DecodeProgress::More => break,
                DecodeProgress::Bad(_) => {}
                DecodeProgress::Frame(_) => {
                    bump(&mut self.counters.late);
                    self.late_node = Some(P::node(&exchange.expected));
                    outstanding = None;
                }
            }
        }
        self.counters.discarded = self.counters.discarded.wrapping_add(P::discarded(&exchange.decoder));
        if let Some(until) = outstanding.filter(|&until| until > now) {
            self.outstanding.add(exchange.outstanding(until), now);
        }
    }
}
