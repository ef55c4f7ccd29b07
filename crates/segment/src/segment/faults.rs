//! What goes wrong with a node by order of the scenario: unplugged, babbling, spoiling its own answers.

use clino_sim::node::{Burst, Ns};

use super::chance::{Chance, Probability, Topic};
use crate::log::Alteration;

/// A time in which a node sends random bytes on its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Babble {
    /// First start bit.
    pub from: Ns,
    /// No character begins at or after this.
    pub until: Ns,
    /// Pause between two characters; with 0 the node never lets go of the line.
    pub gap: Ns,
}

/// Everything that may go wrong with one node. Intervals are `[from, until)` and must not overlap.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Faults {
    /// Without power and off the line.
    pub unplugged: Vec<(Ns, Ns)>,
    /// Talking out of turn.
    pub babble: Vec<Babble>,
    /// Probability that one byte of an answer is changed before it is sent.
    pub corrupt: Probability,
    /// Probability that an answer ends early.
    pub shorten: Probability,
}

impl Faults {
    /// Whether the node is unplugged at `at`.
    pub fn unplugged_at(&self, at: Ns) -> bool {
        self.unplugged.iter().any(|&(from, until)| (from..until).contains(&at))
    }

    /// Whether the node babbles at `at`; it sends no answers then.
    pub fn babbles_at(&self, at: Ns) -> bool {
        self.babble.iter().any(|babble| (babble.from..babble.until).contains(&at))
    }

    /// First time after `after` at which the node is unplugged or plugged in.
    pub fn next_power_change(&self, after: Option<Ns>) -> Option<Ns> {
        let changes = self.unplugged.iter().flat_map(|&(from, until)| [from, until]);
        changes.filter(|&at| after.is_none_or(|after| at > after)).min()
    }

    /// The first babbled character that may begin at or after `earliest`, and the pause after it.
    pub fn next_babble(&self, earliest: Ns) -> Option<(Ns, Ns)> {
        self.babble
            .iter()
            .filter(|babble| babble.until > earliest.max(babble.from))
            .map(|babble| (earliest.max(babble.from), babble.gap))
            .min()
    }

    /// Spoils an answer, when chance wants it.
    pub fn spoil(&self, burst: &mut Burst, chance: Chance) -> Option<Alteration> {
        let (at, length) = (burst.start_at, burst.bytes.len());
        if chance.hit(self.shorten, Topic::Shorten, at, 0) && length > 1 {
            let length = 1 + (chance.roll(Topic::Shorten, at, 1) % (length as u64 - 1)) as usize;
            burst.bytes.truncate(length);
            return Some(Alteration::Shortened { length });
        }
        if chance.hit(self.corrupt, Topic::Corrupt, at, 0) && length > 0 {
            let index = (chance.roll(Topic::Corrupt, at, 1) % length as u64) as usize;
            let mask = 1 + (chance.roll(Topic::Corrupt, at, 2) % 255) as u8;
            burst.bytes[index] ^= mask;
            return Some(Alteration::Corrupted { index, mask });
        }
        None
    }
}
