//! One request and when what was heard of its answer came.

use super::late::OutstandingReply;
use crate::{Duration, ExpectedReply, Instant, Timing};

/// No wait is stretched by more than this many characters, or by twice the answer, if that is more. It is twice the
/// T7's 34-byte answer, so that a frame still arrives whole after as many stray characters.
const LONGEST_ANSWER: u32 = 68;

/// A question that is on its way, waits for its answer, or has waited in vain.
pub(super) struct Exchange {
    pub expected: ExpectedReply,
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
    pub contended: bool,
    /// This is a repetition.
    pub retry: bool,
    /// Any number of nodes may answer; what follows is for such an exchange.
    pub collects: bool,
    /// From our last stop bit to the end of the exchange.
    pub window: Duration,
    pub answers: u32,
    pub garbled: u32,
    /// The characters that belong to no frame were reported.
    pub discarded_reported: bool,
}

impl Exchange {
    /// Before the first one.
    pub const NONE: Exchange = Exchange {
        expected: ExpectedReply::NONE,
        latency: Duration::ZERO,
        asked: Instant::ZERO,
        released: Instant::ZERO,
        first: Instant::ZERO,
        last: Instant::ZERO,
        characters: 0,
        contended: false,
        retry: false,
        collects: false,
        window: Duration::ZERO,
        answers: 0,
        garbled: 0,
        discarded_reported: false,
    };

    /// How much longer than its deadline it may be waited for at most: the longest answer, twice over.
    pub fn longest_wait(&self, timing: &Timing) -> Duration {
        let twice = u32::from(self.expected.characters).saturating_mul(2);
        timing.serial.characters(LONGEST_ANSWER.max(twice)) + timing.gap
    }

    /// This request, if its answer may come as late as `until`.
    pub fn outstanding(&self, until: Instant) -> OutstandingReply {
        OutstandingReply { expected: self.expected, due: self.released + self.latency, until }
    }

    /// Our last stop bit was out at `at`: the answer begins now, and what was heard before is no part of it.
    pub fn release(&mut self, at: Instant) {
        (self.released, self.first, self.last) = (at, at, at);
    }

    /// A character came that may belong to the answer.
    pub fn hear(&mut self, at: Instant) {
        if self.characters == 0 {
            self.first = at;
        }
        self.last = at;
        self.characters = self.characters.wrapping_add(1);
    }
}
