//! The silence in which deaf nodes come to.
//!
//! A T7 that has taken noise for the beginning of a command takes what follows for the rest of it, up to
//! [500 ms of silence](Silence::new), and what follows that may look like a beginning again. So a bus keeps silent for once
//!
//! - after every [change of the bit rate](Silence::begin): what was sent at the other rate is noise to the nodes of this one;
//! - when a node dies after [more than once](TROUBLES) something was wrong with the line, but not more often than every
//!   [`SILENCE_EVERY`];
//! - when everybody had [reason to be deaf](Silence::doubt) and somebody does not answer. Everybody is asked once before
//!   that: those who hear need not wait for those who do not.

use clino_bus::{Duration, Instant};

use crate::bits::Bits;

/// What was wrong with the line so long ago has nothing to do with a node that is silent now: the second after which a node
/// is taken for dead, and as much.
const TROUBLE_LASTS: Duration = Duration::from_millis(2_000);
/// A node that is unplugged while it answers makes one bad answer; more is something else.
const TROUBLES: u8 = 2;
/// From one silence to the next, at least: 10 % of the time at most, on a line that is never without noise.
const SILENCE_EVERY: Duration = Duration::from_millis(5_000);

pub(super) struct Silence {
    /// After so long every node takes the next character for the beginning of a request; zero if the nodes need no silence.
    span: Duration,
    /// When something was wrong with the line last, and how often in a row.
    trouble_at: Instant,
    troubles: u8,
    /// Nobody is asked before this.
    until: Instant,
    /// A node may be deaf and has not been given its silence yet.
    owed: bool,
    /// Everybody may be deaf.
    doubted: bool,
    /// Of these, those who have still to be asked,
    unasked: Bits,
    /// and those who did not answer.
    missed: Bits,
}

impl Silence {
    /// After a silence of `span` all nodes hear again, whatever they have taken for a request.
    pub fn new(span: Duration) -> Self {
        Silence {
            span,
            trouble_at: Instant::ZERO,
            troubles: 0,
            until: Instant::ZERO,
            owed: false,
            doubted: false,
            unasked: Bits::EMPTY,
            missed: Bits::EMPTY,
        }
    }

    /// Something was wrong with the line at `at`: what was heard was no answer, or somebody else talked.
    pub fn trouble(&mut self, at: Instant) {
        let before = if self.is_in_trouble(at) { self.troubles } else { 0 };
        (self.trouble_at, self.troubles) = (at, before.saturating_add(1));
    }

    fn is_in_trouble(&self, at: Instant) -> bool {
        at.since(self.trouble_at) <= TROUBLE_LASTS
    }

    /// A node has just been taken for dead, at `at`.
    pub fn died(&mut self, at: Instant) {
        self.owed |= self.troubles >= TROUBLES && self.is_in_trouble(at);
    }

    /// All who have heard something until `since` are given their silence.
    pub fn begin(&mut self, since: Instant) {
        self.until = self.until.max(since + self.span);
    }

    /// Nobody is asked before this.
    pub fn until(&self) -> Instant {
        self.until
    }

    /// These may all be deaf.
    pub fn doubt(&mut self, slots: Bits) {
        if !self.doubted {
            (self.doubted, self.unasked, self.missed) = (true, slots, Bits::EMPTY);
        }
    }

    /// The slot is being asked.
    pub fn asked(&mut self, slot: usize) {
        self.unasked.set(slot, false);
    }

    /// The slot has answered, or nobody is to wait for it.
    pub fn heard(&mut self, slot: usize) {
        self.missed.set(slot, false);
    }

    /// The slot has not answered.
    pub fn missed(&mut self, slot: usize) {
        self.missed.set(slot, self.doubted);
    }

    /// The slot is not on this bus any more.
    pub fn forget(&mut self, slot: usize) {
        self.asked(slot);
        self.heard(slot);
    }

    /// Until when nobody is asked. To be called while no exchange is in hand.
    #[inline(never)]
    pub fn keep(&mut self, now: Instant) -> Instant {
        let often = self.until > Instant::ZERO && now < self.until + SILENCE_EVERY;
        let all_asked = self.doubted && self.unasked.is_empty();
        if (self.owed && !often) || (all_asked && !self.missed.is_empty()) {
            self.owed = false;
            self.until = now + self.span;
        }
        if all_asked {
            (self.doubted, self.missed) = (false, Bits::EMPTY);
        }
        self.until
    }
}
