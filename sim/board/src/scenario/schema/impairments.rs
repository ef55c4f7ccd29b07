//! Impairments of the input of the console and the Modbus port.

use serde::Deserialize;
use toml::Spanned;

use super::intervals::{Interval, Lasting};
use crate::gaps;
use crate::impairment::{self, Choice, Echoer, Effect};
use crate::scenario::units::{Chances, Number, Time};

/// A pause of the sender.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gap {
    /// Index of the byte after it.
    pub before: usize,
    /// Its length.
    pub length: Time,
}

impl Gap {
    /// In the far end's terms.
    pub fn in_line(&self) -> gaps::Gap {
        gaps::Gap { before: self.before, length: self.length.0 }
    }
}

/// The gateway hears what it sends.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Echo {
    /// How much later.
    #[serde(default)]
    pub delay: Time,
    /// From what.
    #[serde(default)]
    pub by: Echoer,
}

impl Echo {
    /// In the line's terms.
    pub fn in_line(&self) -> impairment::Echo {
        impairment::Echo { delay: self.delay.0, by: self.by }
    }
}

/// Something that is done to characters: to some, or to random ones.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Impairment {
    /// What is done.
    pub effect: Spanned<Effect>,
    /// Number of the first character.
    pub character: Option<u64>,
    /// How many of them; one if it does not say.
    pub count: Option<Spanned<u64>>,
    /// Probability.
    pub rate: Option<Number<Chances>>,
    /// When; always if it does not say.
    pub within: Option<Spanned<Interval>>,
}

impl Impairment {
    /// In the line's terms.
    pub fn in_line(&self) -> impairment::Impairment {
        let choice = match self.character {
            Some(first) => {
                Choice::Characters { first, count: self.count.as_ref().map_or(1, |count| *count.get_ref()) }
            }
            None => Choice::Random {
                rate: self.rate.as_ref().map(|rate| rate.0).unwrap_or_default(),
                within: self.within.as_ref().map(|within| within.get_ref().bounds()),
            },
        };
        impairment::Impairment { effect: *self.effect.get_ref(), choice }
    }
}
