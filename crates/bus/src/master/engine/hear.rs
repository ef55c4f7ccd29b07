//! Characters and frames that come during an exchange, and their meaning.

use clino_codec::character::Character;
use clino_codec::checks::Check;

use super::{Engine, Rest, State};
use crate::counters::bump;
use crate::{Instant, ReplyHeader};

/// What a frame is that was refused.
pub(crate) enum Refused {
    /// Nothing to the exchange in hand.
    Unused,
    /// The reason why there is no answer, unless one comes.
    Kept,
    /// An outcome of an exchange that collects.
    Reported,
}

/// What a good frame is.
pub(crate) enum Framed {
    /// Not the answer to the request in hand.
    Unused,
    /// The answer. The exchange is over.
    Answer,
    /// One of the answers to an exchange that collects.
    Reported,
}

impl Engine {
    /// Our last stop bit was out at `at`. `rest` is what the decoder held then.
    #[inline(never)]
    pub(crate) fn released(&mut self, rest: Rest, at: Instant) {
        self.discard(rest);
        let exchange = &mut self.exchange;
        exchange.release(at);
        let one = self.timing.first_character(exchange.latency) + self.adaptive.extension();
        let wait = exchange.window.longer(one);
        self.enter(State::Waiting, at + wait);
    }

    /// Another node transmitted during our frame.
    pub(crate) fn contended(&mut self) {
        if self.is_asking() && !core::mem::replace(&mut self.exchange.contended, true) {
            bump(&mut self.counters.contention);
        }
    }

    /// A character came. Returns whether the decoder is to have it.
    pub(crate) fn heard(&mut self, character: Character, at: Instant) -> bool {
        self.counters.character(character);
        match self.state {
            // Unsolicited.
            State::Idle => {
                bump(&mut self.counters.unasked);
                bump(&mut self.counters.discarded);
                return false;
            }
            // A late answer, or a node out of turn.
            State::Sending => bump(&mut self.counters.unasked),
            State::Waiting | State::Quiet => {
                let gap = self.timing.gap + self.character;
                self.due = self.due.max(at + gap).min(self.give_up);
                self.exchange.hear(at);
            }
        }
        true
    }

    /// A frame was refused that ended at `at`: by this check, and with this header if it is intact.
    #[inline(never)]
    pub(crate) fn refused(&mut self, check: Check, header: Option<ReplyHeader>, at: Instant) -> Refused {
        match header.and_then(|header| self.outstanding.claim(self.exchange.asked, header)) {
            Some(reply) => self.claimed(&reply, at),
            None => self.counters.refused(check),
        }
        if !self.is_waiting() {
            return Refused::Unused;
        }
        if !self.exchange.collects {
            return Refused::Kept;
        }
        bump(&mut self.counters.bad_answer);
        bump(&mut self.exchange.garbled);
        Refused::Reported
    }

    /// A good frame ended at `at`, `alone` if all that was heard is this frame.
    #[inline(never)]
    pub(crate) fn framed(&mut self, header: ReplyHeader, alone: bool, at: Instant) -> Framed {
        if self.is_quiet() {
            self.came_late_in_quiet(at);
            return Framed::Unused;
        }
        let waiting = self.is_waiting();
        if let Some(reply) = self.outstanding.claim(self.exchange.asked, header) {
            self.claimed(&reply, at);
            if waiting {
                // What was heard so far was no answer to this one.
                self.exchange.characters = 0;
            }
            return Framed::Unused;
        }
        if !waiting {
            // Intact, but no request is out yet.
            bump(&mut self.counters.foreign);
            return Framed::Unused;
        }
        bump(&mut self.counters.good);
        let exchange = &mut self.exchange;
        self.history.answered(exchange.expected.node);
        if !exchange.retry {
            bump(&mut self.counters.first_try);
        }
        if exchange.collects {
            bump(&mut exchange.answers);
            return Framed::Reported;
        }
        // With anything before it, the first character may be another's.
        if alone {
            let response = exchange.first.since(exchange.released);
            self.counters.response(response);
            self.adaptive.note(response - (exchange.latency + self.character), &self.timing);
        }
        self.state = State::Idle;
        Framed::Answer
    }

    /// These characters belong to nothing.
    pub(crate) fn discard(&mut self, rest: Rest) {
        self.counters.discarded = self.counters.discarded.wrapping_add(rest.discarded);
    }
}
