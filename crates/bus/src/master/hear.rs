//! Characters received during an exchange, and their meaning.

use clino_codec::DecodeProgress;
use clino_codec::character::Character;

use super::exchange::Exchange;
use super::{ExchangeOutcome, Fault, Master, State};
use crate::counters::bump;
use crate::{FailedCheck, Instant, Protocol};

impl<P: Protocol> Master<P> {
    pub(super) fn released(&mut self, at: Instant) {
        let (State::Sending { .. }, Some(exchange)) = (self.state, &mut self.exchange) else { return };
        self.counters.discarded = self.counters.discarded.wrapping_add(exchange.release(at));
        let one = self.timing.first_character(exchange.latency) + self.adaptive.extension();
        let wait = exchange.collecting.as_ref().map_or(one, |collecting| collecting.window().longer(one));
        let deadline = at + wait;
        let give_up = deadline + exchange.longest_wait(&self.timing);
        self.state = State::Waiting { deadline, give_up };
    }

    pub(super) fn contended(&mut self) {
        if self.is_asking()
            && let Some(exchange) = &mut self.exchange
            && !core::mem::replace(&mut exchange.contended, true)
        {
            bump(&mut self.counters.contention);
        }
    }

    pub(super) fn heard(&mut self, character: Character, at: Instant) -> Option<ExchangeOutcome<P>> {
        self.counters.character(character);
        if matches!(self.state, State::Idle | State::Sending { .. }) {
            bump(&mut self.counters.unasked);
        }
        let gap = self.timing.gap + self.character;
        let progress = match (&mut self.state, &mut self.exchange) {
            // Unsolicited.
            (State::Idle, _) | (_, None) => {
                bump(&mut self.counters.discarded);
                return None;
            }
            // A late answer, or a node out of turn.
            (State::Sending { .. }, Some(exchange)) => P::push(&mut exchange.decoder, character),
            (State::Waiting { deadline, give_up }, Some(exchange)) => {
                *deadline = (*deadline).max(at + gap).min(*give_up);
                exchange.hear(character, at)
            }
            (State::Quiet { clear, give_up, .. }, Some(exchange)) => {
                *clear = (*clear).max(at + gap).min(*give_up);
                exchange.hear(character, at)
            }
        };
        self.progressed(progress, at)
    }

    /// What a decoder's progress means in the state at hand.
    pub(super) fn progressed(
        &mut self,
        progress: DecodeProgress<P::Answer, P::DecodeError>,
        at: Instant,
    ) -> Option<ExchangeOutcome<P>> {
        let asked = self.exchange()?.asked;
        match progress {
            DecodeProgress::More => None,
            DecodeProgress::Bad(error) => {
                let fits = |earlier: &P::Expected| P::answers_refused(&error, earlier);
                match self.outstanding.claim(asked, fits) {
                    Some(reply) => self.came_late(&reply, at),
                    None => self.counters.refused(error.failed_check()),
                }
                self.refused(error, at)
            }
            DecodeProgress::Frame(answer) => {
                if let State::Quiet { .. } = self.state {
                    self.came_late_in_quiet(at);
                    return None;
                }
                let reply = self.outstanding.claim(asked, |earlier| P::answers(&answer, earlier));
                match (self.state, reply) {
                    (_, Some(reply)) => {
                        self.came_late(&reply, at);
                        self.pass_over();
                        None
                    }
                    (State::Waiting { .. }, None) => self.answered(answer, at),
                    // Intact, but no request is out yet.
                    (_, None) => {
                        bump(&mut self.counters.foreign);
                        None
                    }
                }
            }
        }
    }

    /// A frame was refused while its answer is awaited.
    fn refused(&mut self, error: P::DecodeError, at: Instant) -> Option<ExchangeOutcome<P>> {
        let (State::Waiting { .. }, Some(exchange)) = (self.state, &mut self.exchange) else { return None };
        match &mut exchange.collecting {
            None => {
                exchange.bad = Some(error);
                None
            }
            Some(collecting) => {
                bump(&mut self.counters.bad_answer);
                Some(ExchangeOutcome { result: collecting.report(Err(Fault::Bad(error))), at })
            }
        }
    }

    /// The answer is here: the end of the exchange, unless it collects.
    fn answered(&mut self, answer: P::Answer, at: Instant) -> Option<ExchangeOutcome<P>> {
        bump(&mut self.counters.good);
        let (State::Waiting { .. }, Some(exchange)) = (self.state, &mut self.exchange) else { return None };
        self.history.answered(P::node(&exchange.expected));
        if !exchange.retry {
            bump(&mut self.counters.first_try);
        }
        if let Some(collecting) = &mut exchange.collecting {
            return Some(ExchangeOutcome { result: collecting.report(Ok(answer)), at });
        }
        if let Some(response) = exchange.response() {
            self.counters.response(response);
            self.adaptive.note(response - (exchange.latency + self.character), &self.timing);
        }
        self.counters.discarded = self.counters.discarded.wrapping_add(exchange.finish());
        self.state = State::Idle;
        Some(ExchangeOutcome { result: Ok(answer), at })
    }

    /// What was heard of this exchange so far was a late answer to another one.
    fn pass_over(&mut self) {
        if let (State::Waiting { .. }, Some(exchange)) = (self.state, &mut self.exchange) {
            exchange.characters = 0;
        }
    }

    /// The exchange in hand.
    fn exchange(&self) -> Option<&Exchange<P>> {
        self.exchange.as_ref().filter(|_| !matches!(self.state, State::Idle))
    }
}
