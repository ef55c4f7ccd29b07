//! Faults that the scenario orders. Of a node: unplugged, babbling, spoiling its own answers. With the line:
//! shorted, driven by the gateway without a pause.

use clino_sim::node::{Burst, Ns};

use super::chance::{Chance, Probability, Topic};
use crate::log::Alteration;

/// A time in which the pair is shorted: every receiver reads this level, for any driver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StuckLine {
    /// First instant.
    pub from: Ns,
    /// First instant after.
    pub until: Ns,
    /// The level that is read.
    pub high: bool,
}

/// What goes wrong with the line itself. Intervals are `[from, until)`; those of a list must not overlap.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LineFaults {
    /// The pair is shorted.
    pub stuck: Vec<StuckLine>,
    /// The DE input of the gateway's transceiver is shorted to its supply: the driver is on, regardless of the pin.
    pub de_shorted: Vec<(Ns, Ns)>,
}

impl LineFaults {
    /// The level to which the pair is shorted at `at`, if it is.
    pub fn stuck_at(&self, at: Ns) -> Option<bool> {
        let stuck = self.stuck.iter().find(|stuck| (stuck.from..stuck.until).contains(&at))?;
        Some(stuck.high)
    }

    /// Whether the gateway's driver cannot be switched off at `at`.
    pub fn de_shorted_at(&self, at: Ns) -> bool {
        self.de_shorted.iter().any(|&(from, until)| (from..until).contains(&at))
    }

    /// First instant after `after` at which any of this begins or ends.
    pub fn next_change(&self, after: Option<Ns>) -> Option<Ns> {
        let stuck = self.stuck.iter().flat_map(|stuck| [stuck.from, stuck.until]);
        let de = self.de_shorted.iter().flat_map(|&(from, until)| [from, until]);
        stuck.chain(de).filter(|&at| after.is_none_or(|after| at > after)).min()
    }
}

/// A time in which a node sends random bytes on its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Babble {
    /// First start bit.
    pub from: Ns,
    /// No character begins at or after this.
    pub until: Ns,
    /// Pause between two characters; with 0 the node never releases the line.
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
