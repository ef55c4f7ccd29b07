//! One question, one answer, one deadline.
//!
//! ```text
//!        begin           Released           first character late, gap too long
//!  Idle ───────▶ Sending ────────▶ Waiting ─────────────────────────────────▶ Quiet ──▶ Idle
//!                                     │ answer                                  (late answers are
//!                                     └────────────────────────────────▶ Idle    counted, never used)
//! ```
//!
//! A character that comes in never shortens a wait, so junk at turnaround costs nothing; and however long a
//! node babbles, a wait ends at [`LONGEST_ANSWER`] characters after its deadline.

use clino_codec::Progress;
use clino_codec::character::Character;

use crate::counters::{Counters, bump};
pub use crate::line::Event;
use crate::protocol::Protocol;
use crate::{Micros, Timing};

/// No wait is stretched by more than this many characters: twice the T7's 34-byte answer, so that junk of a
/// frame's length before a frame still leaves it whole.
pub const LONGEST_ANSWER: u64 = 68;

/// Why there is no answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault<E> {
    /// The line stayed silent until the deadline.
    NoAnswer {
        /// From DE low to the deadline.
        waited: Micros,
    },
    /// Characters came, but no frame.
    Garbled {
        /// How many.
        characters: u32,
    },
    /// A frame came, but not the awaited one, or it failed a check.
    Bad(E),
    /// Our own frame did not get out whole: the line did not fall silent, or the driver was switched off by force.
    NotSent,
}

/// How an exchange ended.
#[derive(Debug)]
pub struct Outcome<P: Protocol> {
    /// The answer, or why there is none.
    pub result: Result<P::Answer, Fault<P::DecodeError>>,
    /// When it ended: the stop bit of the answer's last character, or the deadline.
    pub at: Micros,
}

enum State<P: Protocol> {
    Idle,
    Sending { exchange: Exchange<P>, give_up: Micros },
    Waiting { exchange: Exchange<P>, deadline: Micros, give_up: Micros },
    Quiet { exchange: Exchange<P>, until: Micros, give_up: Micros },
}

struct Exchange<P: Protocol> {
    decoder: P::Decoder,
    latency: Micros,
    released: Micros,
    /// Stop bit of the last character heard.
    last: Micros,
    characters: u32,
    bad: Option<P::DecodeError>,
}

impl<P: Protocol> Exchange<P> {
    /// No more characters come: lets the decoder decide about those it holds.
    fn settle(&mut self) -> Option<P::Answer> {
        // Each report takes at least one character out of the decoder, so this ends.
        for _ in 0..LONGEST_ANSWER {
            match P::idle(&mut self.decoder) {
                Progress::More => break,
                Progress::Frame(answer) => return Some(answer),
                Progress::Bad(error) => self.bad = Some(error),
            }
        }
        None
    }

    /// Why there is no answer at `deadline`.
    fn fault(&mut self, deadline: Micros) -> Fault<P::DecodeError> {
        match self.bad.take() {
            Some(error) => Fault::Bad(error),
            None if self.characters > 0 => Fault::Garbled { characters: self.characters },
            None => Fault::NoAnswer { waited: deadline.since(self.released) },
        }
    }
}

/// Master of one bus that speaks `P`. Frames go out through a [`Line`](crate::Line), whose events come in here.
pub struct Master<P: Protocol> {
    timing: Timing,
    state: State<P>,
    counters: Counters,
}

impl<P: Protocol> Master<P> {
    /// A master with nothing in hand.
    pub fn new(timing: Timing) -> Self {
        Master { timing, state: State::Idle, counters: Counters::default() }
    }

    /// Whether [`Master::begin`] may be called.
    pub fn is_idle(&self) -> bool {
        matches!(self.state, State::Idle)
    }

    /// Opens an exchange and returns the frame to submit to the line. An exchange in hand is given up.
    pub fn begin(
        &mut self,
        address: P::Address,
        request: &P::Request,
        now: Micros,
    ) -> Result<P::Frame, P::EncodeError> {
        let frame = P::encode(address, request)?;
        let exchange = Exchange {
            decoder: P::decoder(address, request),
            latency: P::latency(request, &self.timing),
            released: now,
            last: now,
            characters: 0,
            bad: None,
        };
        // The line reports how the frame ended; this deadline, twice what it may take, covers one that does not.
        let longest = self.timing.line_busy + self.timing.serial.characters(frame.as_ref().len() as u64);
        let give_up = now + longest.times(2);
        self.state = State::Sending { exchange, give_up };
        bump(&mut self.counters.requests);
        Ok(frame)
    }

    /// Takes an event of the line.
    pub fn on(&mut self, event: Event) -> Option<Outcome<P>> {
        match event {
            Event::Released { at } => {
                self.released(at);
                None
            }
            Event::Forced { at } => {
                bump(&mut self.counters.forced);
                self.not_sent(at)
            }
            Event::GivenUp { at } => {
                bump(&mut self.counters.line_busy);
                self.not_sent(at)
            }
            Event::Heard { character, at } => self.heard(character, at),
        }
    }

    /// Lets time pass.
    pub fn poll(&mut self, now: Micros) -> Option<Outcome<P>> {
        match &mut self.state {
            State::Idle => None,
            State::Sending { give_up, .. } => {
                if now < *give_up {
                    return None;
                }
                self.fail(Fault::NotSent, now)
            }
            State::Waiting { exchange, deadline, .. } => {
                if now < *deadline {
                    return None;
                }
                let (deadline, last) = (*deadline, exchange.last);
                match exchange.settle() {
                    Some(answer) => self.answered(answer, last),
                    None => {
                        let fault = exchange.fault(deadline);
                        self.fail(fault, now)
                    }
                }
            }
            State::Quiet { exchange, until, .. } => {
                if now >= *until {
                    if exchange.settle().is_some() {
                        bump(&mut self.counters.late);
                    }
                    self.close();
                }
                None
            }
        }
    }

    /// When [`Master::poll`] has something to do, if ever.
    pub fn poll_at(&self) -> Option<Micros> {
        match &self.state {
            State::Idle => None,
            State::Sending { give_up, .. } => Some(*give_up),
            State::Waiting { deadline, .. } => Some(*deadline),
            State::Quiet { until, .. } => Some(*until),
        }
    }

    /// What happened since reset.
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// The waits in force.
    pub fn timing(&self) -> &Timing {
        &self.timing
    }

    fn released(&mut self, at: Micros) {
        self.state = match core::mem::replace(&mut self.state, State::Idle) {
            State::Sending { mut exchange, .. } => {
                exchange.released = at;
                let deadline = at + self.timing.first_character(exchange.latency);
                let give_up = deadline + self.longest_wait();
                State::Waiting { exchange, deadline, give_up }
            }
            other => other,
        };
    }

    fn heard(&mut self, character: Character, at: Micros) -> Option<Outcome<P>> {
        self.counters.character(character.errors);
        let gap = self.timing.gap + self.timing.serial.characters(1);
        match &mut self.state {
            // Nobody was asked. While we send, only an echo or a node out of turn can be heard.
            State::Idle | State::Sending { .. } => {
                bump(&mut self.counters.junk);
                None
            }
            State::Waiting { exchange, deadline, give_up } => {
                if exchange.characters == 0 {
                    self.counters.response(at.since(exchange.released));
                }
                exchange.characters = exchange.characters.saturating_add(1);
                exchange.last = at;
                *deadline = (*deadline).max(at + gap).min(*give_up);
                match P::push(&mut exchange.decoder, character) {
                    Progress::More => None,
                    Progress::Bad(error) => {
                        exchange.bad = Some(error);
                        None
                    }
                    Progress::Frame(answer) => self.answered(answer, at),
                }
            }
            State::Quiet { exchange, until, give_up } => {
                *until = (*until).max(at + gap).min(*give_up);
                if let Progress::Frame(_) = P::push(&mut exchange.decoder, character) {
                    bump(&mut self.counters.late);
                }
                None
            }
        }
    }

    /// Ends the exchange in hand with its answer.
    fn answered(&mut self, answer: P::Answer, at: Micros) -> Option<Outcome<P>> {
        bump(&mut self.counters.good);
        self.close();
        Some(Outcome { result: Ok(answer), at })
    }

    /// Nothing more is expected of the exchange in hand.
    fn close(&mut self) {
        if let State::Waiting { exchange, .. } | State::Quiet { exchange, .. } = &self.state {
            self.counters.junk = self.counters.junk.wrapping_add(P::junk(&exchange.decoder));
        }
        self.state = State::Idle;
    }

    /// Ends the exchange in hand with a fault, and keeps quiet for a while.
    fn fail(&mut self, fault: Fault<P::DecodeError>, at: Micros) -> Option<Outcome<P>> {
        match fault {
            Fault::NoAnswer { .. } => bump(&mut self.counters.no_answer),
            Fault::Garbled { .. } | Fault::Bad(_) => bump(&mut self.counters.bad_answer),
            Fault::NotSent => {}
        }
        let until = at + self.timing.quiet;
        let give_up = until + self.longest_wait();
        match core::mem::replace(&mut self.state, State::Idle) {
            State::Sending { exchange, .. } | State::Waiting { exchange, .. } => {
                self.state = State::Quiet { exchange, until, give_up };
                Some(Outcome { result: Err(fault), at })
            }
            other => {
                self.state = other;
                None
            }
        }
    }

    fn not_sent(&mut self, at: Micros) -> Option<Outcome<P>> {
        match self.state {
            State::Sending { .. } => self.fail(Fault::NotSent, at),
            _ => None,
        }
    }

    fn longest_wait(&self) -> Micros {
        self.timing.serial.characters(LONGEST_ANSWER) + self.timing.gap
    }
}

#[cfg(test)]
mod tests;
