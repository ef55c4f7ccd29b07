//! How an exchange ends without its answer, and what may come after that.

use clino_codec::checks::Check;

use super::late::{OutstandingReply, Reply};
use super::{Engine, Rest, State};
use crate::counters::bump;
use crate::{Duration, Instant};

/// What an exchange without its answer leaves behind.
#[derive(Clone, Copy)]
pub(super) enum End {
    /// The line stayed silent.
    Silent,
    /// Something came: a frame that this check refused, or none.
    Bad(Option<Check>),
    /// The node may have heard the request, or a part of it.
    Unanswered,
    /// Nothing was sent.
    Unasked,
}

/// Why there is no answer at the deadline.
pub(crate) enum Missed {
    /// The frame that was refused last was no answer.
    Refused,
    /// Characters came, but no frame.
    Garbled {
        characters: u32,
    },
    NoAnswer {
        waited: Duration,
    },
    Contention,
    /// The window of a collecting exchange is over.
    Over {
        answers: u32,
        garbled: u32,
    },
}

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
    ) -> Option<(Missed, Instant)> {
        if !self.is_waiting() {
            return None;
        }
        let exchange = &mut self.exchange;
        // What belongs to no frame is reported once, then the sum.
        if exchange.collects && discarded > 0 && !exchange.discarded_reported {
            exchange.discarded_reported = true;
            bump(&mut exchange.garbled);
            return Some((Missed::Garbled { characters: discarded }, exchange.last));
        }
        let (missed, end) = match (bad, exchange.characters) {
            _ if exchange.collects => {
                (Missed::Over { answers: exchange.answers, garbled: exchange.garbled }, End::Unanswered)
            }
            _ if exchange.contended => (Missed::Contention, End::Unanswered),
            (Some(check), _) => (Missed::Refused, End::Bad(Some(check))),
            (None, 0) => (Missed::NoAnswer { waited: self.due.since(exchange.released) }, End::Silent),
            (None, characters) => (Missed::Garbled { characters }, End::Bad(None)),
        };
        self.fail(end, now);
        Some((missed, now))
    }

    /// Ends the exchange in hand without its answer, and keeps quiet for a while.
    #[inline(never)]
    pub(super) fn fail(&mut self, end: End, at: Instant) {
        let (mut quiet, mut is_to_come) = (self.timing.quiet, true);
        match end {
            End::Silent => {
                bump(&mut self.counters.no_answer);
                quiet = self.history.missed(self.exchange.expected.node, &self.timing);
            }
            End::Bad(check) => {
                bump(&mut self.counters.bad_answer);
                // A node answers once, however badly; this was another one's answer, or one to another command.
                is_to_come = matches!(check, None | Some(Check::Address | Check::Command));
            }
            End::Unasked => is_to_come = false,
            End::Unanswered => {}
        }
        self.late_until = if is_to_come { at + self.timing.late } else { Instant::ZERO };
        self.enter(State::Quiet, at + quiet);
    }

    /// What lasts until `due`, and longer if something is heard.
    pub(super) fn enter(&mut self, state: State, due: Instant) {
        (self.state, self.due) = (state, due);
        self.give_up = due + self.exchange.longest_wait(&self.timing);
    }

    /// Our frame did not get out whole. Returns whether that ends an exchange.
    pub(super) fn not_sent(&mut self, end: End, at: Instant) -> bool {
        let is_sending = self.is_sending();
        if is_sending {
            self.fail(end, at);
        }
        is_sending
    }

    /// A late answer to this request ended at `at`.
    pub(super) fn came_late(&mut self, reply: &OutstandingReply, at: Instant) {
        self.note_late(Some(reply.expected.node));
        self.history.late(reply.expected.node);
        self.adaptive.note(reply.lateness(at, self.timing.serial), &self.timing);
    }

    /// A late answer to an earlier request ended at `at`.
    pub(super) fn claimed(&mut self, reply: &Reply, at: Instant) {
        match reply.known() {
            Some(reply) => self.came_late(reply, at),
            None => self.note_late(None),
        }
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
            self.note_late(Some(self.exchange.expected.node));
            self.late_until = Instant::ZERO;
        }
        self.discard(rest);
        if self.late_until > now {
            self.outstanding.add(self.exchange.outstanding(self.late_until));
        }
    }

    /// Of this node, if it is known.
    fn note_late(&mut self, node: Option<u8>) {
        bump(&mut self.counters.late);
        self.late_node = node;
    }
}
