//! One request and the characters received since.

use clino_codec::DecodeProgress;
use clino_codec::character::Character;

use super::late::OutstandingReply;
use super::{Fault, LONGEST_ANSWER};
use crate::counters::bump;
use crate::{Duration, Instant, Protocol, Timing};

/// A question that is on its way, waits for its answer, or has waited in vain.
pub(super) struct Exchange<P: Protocol> {
    pub expected: P::Expected,
    pub decoder: P::Decoder,
    /// What the node may take to answer, by its document.
    pub latency: Duration,
    /// When it began.
    pub asked: Instant,
    /// Our last stop bit.
    pub released: Instant,
    /// Stop bits of the first and the last character heard since.
    pub first: Instant,
    pub last: Instant,
    pub characters: u32,
    pub bad: Option<P::DecodeError>,
    pub contended: bool,
    /// This is a repetition.
    pub retry: bool,
    pub collecting: Option<Collecting>,
}

/// What is kept for an exchange in which any number of nodes may answer.
pub(super) struct Collecting {
    /// From our last stop bit to the end of the exchange.
    window: Duration,
    answers: u32,
    garbled: u32,
    discarded_reported: bool,
}

impl Collecting {
    pub fn new(window: Duration) -> Collecting {
        Collecting { window, answers: 0, garbled: 0, discarded_reported: false }
    }

    pub fn window(&self) -> Duration {
        self.window
    }

    /// Keeps the account of what is reported.
    pub fn report<A, E>(&mut self, result: Result<A, Fault<E>>) -> Result<A, Fault<E>> {
        match &result {
            Ok(_) => bump(&mut self.answers),
            Err(_) => bump(&mut self.garbled),
        }
        result
    }
}

impl<P: Protocol> Exchange<P> {
    pub fn new(
        expected: P::Expected,
        latency: Duration,
        retry: bool,
        collecting: Option<Collecting>,
        now: Instant,
    ) -> Self {
        Exchange {
            expected,
            decoder: P::decoder(expected),
            latency,
            asked: now,
            released: now,
            first: now,
            last: now,
            characters: 0,
            bad: None,
            contended: false,
            retry,
            collecting,
        }
    }

    /// Begins another one, in place.
    pub fn restart(
        &mut self,
        expected: P::Expected,
        latency: Duration,
        retry: bool,
        collecting: Option<Collecting>,
        now: Instant,
    ) {
        P::restart(&mut self.decoder, expected);
        (self.expected, self.latency, self.retry, self.collecting) = (expected, latency, retry, collecting);
        (self.asked, self.released, self.first, self.last) = (now, now, now, now);
        (self.characters, self.bad, self.contended) = (0, None, false);
    }

    /// How much longer than its deadline it may be waited for at most: the longest answer, twice over.
    pub fn longest_wait(&self, timing: &Timing) -> Duration {
        let twice = (P::size(&self.expected) as u32).saturating_mul(2);
        timing.serial.characters(LONGEST_ANSWER.max(twice)) + timing.gap
    }

    /// This request, if its answer may come as late as `until`.
    pub fn outstanding(&self, until: Instant) -> OutstandingReply<P::Expected> {
        OutstandingReply { expected: self.expected, due: self.released + self.latency, until }
    }

    /// Our last stop bit was out at `at`: the answer begins now, and what was heard before is no part of it. Returns
    /// how many of those characters were discarded.
    pub fn release(&mut self, at: Instant) -> u32 {
        let discarded = self.finish();
        (self.released, self.first, self.last) = (at, at, at);
        P::restart(&mut self.decoder, self.expected);
        discarded
    }

    /// Takes a character that may belong to the answer.
    pub fn hear(&mut self, character: Character, at: Instant) -> DecodeProgress<P::Answer, P::DecodeError> {
        if self.characters == 0 {
            self.first = at;
        }
        self.last = at;
        self.characters = self.characters.saturating_add(1);
        P::push(&mut self.decoder, character)
    }

    /// From our last stop bit to the end of the answer's first character, if nothing was heard before that.
    pub fn response(&self) -> Option<Duration> {
        (P::discarded(&self.decoder) == 0 && self.bad.is_none()).then(|| self.first.since(self.released))
    }

    /// No more characters come: lets the decoder decide about those it holds, and returns how many characters were
    /// discarded.
    pub fn finish(&mut self) -> u32 {
        // Each report takes at least one character out of the decoder, so this ends.
        while !matches!(P::idle(&mut self.decoder), DecodeProgress::More) {}
        P::discarded(&self.decoder)
    }

    /// Why there is no answer at `deadline`.
    pub fn fault(&mut self, deadline: Instant) -> Fault<P::DecodeError> {
        match self.bad.take() {
            _ if self.contended => Fault::Contention,
            Some(error) => Fault::Bad(error),
            None if self.characters > 0 => Fault::Garbled { characters: self.characters },
            None => Fault::NoAnswer { waited: deadline.since(self.released) },
        }
    }

    /// The end of a collecting exchange, when there is nothing left to report: its discarded characters once, then the sum.
    pub fn over(&mut self) -> Fault<P::DecodeError> {
        let characters = P::discarded(&self.decoder);
        let Some(collecting) = &mut self.collecting else { return Fault::Over { answers: 0, garbled: 0 } };
        if characters > 0 && !core::mem::replace(&mut collecting.discarded_reported, true) {
            bump(&mut collecting.garbled);
            return Fault::Garbled { characters };
        }
        Fault::Over { answers: collecting.answers, garbled: collecting.garbled }
    }
}
