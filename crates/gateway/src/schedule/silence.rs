//! The silence after which deaf nodes recognise requests again.
//!
//! A T7 that has taken noise for the beginning of a command takes what follows for the rest of it, up to [500 ms of
//! silence](Silence::new), and what follows that may look like a beginning again. So a bus keeps silent once:
//!
//! - after every [change of the bit rate](Silence::begin): requests at the old rate are noise to nodes at the new one;
//! - when a node dies and there was more than one line error [shortly before](TROUBLE_LASTS), but not more often than every
//!   [`SILENCE_EVERY`];
//! - while a node stays dead, because noise may have reached that node alone: after a pause that doubles up to
//!   [`LONGEST_PAUSE`]. It begins with [`SILENCE_EVERY`] if there was more than one line error [in the minute before
//!   ](NOISE_LASTS) the node died, else it is the longest from the first, because that node is more likely unplugged;
//! - when all nodes [may be deaf](Silence::suspect_deaf) and one of them does not answer. Every node is asked once
//!   before that: nodes that are not deaf need not wait for those that are.

use clino_bus::{Duration, Instant};

use crate::bits::Bits;

/// An older line error has nothing to do with a node that is silent now: twice the second after which a node is taken
/// for dead.
const TROUBLE_LASTS: Duration = Duration::from_millis(2_000);
/// After an older line error the line is taken for quiet.
const NOISE_LASTS: Duration = Duration::from_millis(60_000);
/// The least time from one silence to the next: on a line with constant noise the bus is silent for 10 % of the time at
/// most.
const SILENCE_EVERY: Duration = Duration::from_millis(5_000);
/// The longest pause between two silences for nodes that stay dead. Half a second of ten minutes is 0.09 % of the bus,
/// and the other nodes are half a second older then.
const LONGEST_PAUSE: Duration = Duration::from_millis(600_000);

pub(super) struct Silence {
    /// After this time of silence every node takes the next character for the beginning of a request; zero if the nodes
    /// need no silence.
    span: Duration,
    /// The last two line errors. A node that is unplugged while it answers makes one bad answer; more have another
    /// cause.
    troubles: [Option<Instant>; 2],
    /// No request is sent before this.
    until: Instant,
    /// A node may be deaf, and the silence for it has not begun yet.
    owed: bool,
    /// The first instant of the next silence for nodes that stay dead, and the pause before it.
    late_at: Instant,
    late_pause: Duration,
    /// All nodes that are not dead may be deaf.
    suspected: bool,
    /// Slots that have not been asked since then,
    unasked: Bits,
    /// and slots that did not answer.
    missed: Bits,
}

impl Silence {
    /// After a silence of `span` every node recognises requests again.
    pub fn new(span: Duration) -> Self {
        Silence {
            span,
            troubles: [None; 2],
            until: Instant::ZERO,
            owed: false,
            late_at: Instant::ZERO,
            late_pause: LONGEST_PAUSE,
            suspected: false,
            unasked: Bits::EMPTY,
            missed: Bits::EMPTY,
        }
    }

    /// A line error at `at`: the characters received were no answer, or another sender was active.
    pub fn trouble(&mut self, at: Instant) {
        let [_, last] = self.troubles;
        self.troubles = [last, Some(at)];
    }

    /// Whether there were two line errors not longer than this before `at`, and before each other.
    fn were_within(&self, span: Duration, at: Instant) -> bool {
        match self.troubles {
            [Some(first), Some(second)] => at.since(second) <= span && second.since(first) <= span,
            _ => false,
        }
    }

    /// A node has just been taken for dead, at `at`.
    pub fn died(&mut self, at: Instant) {
        self.owed |= self.were_within(TROUBLE_LASTS, at);
        // A silence that is still to come for another dead node is not put off.
        let is_awaited = self.late_at > at;
        if self.were_within(NOISE_LASTS, at) {
            self.late_pause = SILENCE_EVERY;
        } else if !is_awaited {
            self.late_pause = LONGEST_PAUSE;
        }
        let late_at = at + self.late_pause;
        self.late_at = if is_awaited { self.late_at.min(late_at) } else { late_at };
    }

    /// A node that is taken for dead has not answered, at `at`.
    pub fn stays_dead(&mut self, at: Instant) {
        self.owed |= at >= self.late_at;
    }

    /// Begins the silence for all nodes that have received anything up to `since`.
    pub fn begin(&mut self, since: Instant) {
        self.until = self.until.max(since + self.span);
    }

    /// No request is sent before this.
    pub fn until(&self) -> Instant {
        self.until
    }

    /// The nodes of these slots may all be deaf.
    pub fn suspect_deaf(&mut self, slots: Bits) {
        if !self.suspected {
            (self.suspected, self.unasked, self.missed) = (true, slots, Bits::EMPTY);
        }
    }

    /// The slot is being asked.
    pub fn asked(&mut self, slot: usize) {
        self.unasked.set(slot, false);
    }

    /// The slot has answered, or there is no need to wait for it.
    pub fn heard(&mut self, slot: usize) {
        self.missed.set(slot, false);
    }

    /// The slot has not answered.
    pub fn missed(&mut self, slot: usize) {
        self.missed.set(slot, self.suspected);
    }

    /// The slot is not on this bus any more.
    pub fn forget(&mut self, slot: usize) {
        self.asked(slot);
        self.heard(slot);
    }

    /// The instant before which no request is sent. To be called between two exchanges.
    #[inline(never)]
    pub fn keep(&mut self, now: Instant) -> Instant {
        let often = self.until > Instant::ZERO && now < self.until + SILENCE_EVERY;
        let all_asked = self.suspected && self.unasked.is_empty();
        if (self.owed && !often) || (all_asked && !self.missed.is_empty()) {
            self.owed = false;
            self.until = now + self.span;
            self.late_pause = self.late_pause.times(2).min(LONGEST_PAUSE);
            self.late_at = self.until + self.late_pause;
        }
        if all_asked {
            (self.suspected, self.missed) = (false, Bits::EMPTY);
        }
        self.until
    }
}
