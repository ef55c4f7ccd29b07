//! Impairments of the input of the console and the Modbus port: characters lost, changed, added, delayed, or received with
//! an error flag, and an echo of the gateway's own output.
//!
//! They act between the far end and the USART, on whole characters in the order in which they come in. What the far end
//! hears is not changed, nor is the log of the Modbus pair: [`crate::reception`] logs what arrived. Noise within a
//! character, two talkers at once and a wrong bit rate are the pair's own (`clino_segment`).
//!
//! An impairment acts on chosen characters, or on random ones; the same seed gives the same ones. A character is counted
//! from 0 as the far end has sent it since power-up, also if it is lost. An echo is not counted, and only random
//! impairments act on it. Several act on one character in the order in which they are given.

mod line;
#[cfg(test)]
mod tests;

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard};

use clino_segment::Probability;
use clino_sim::node::Ns;
use serde::Deserialize;

use crate::scenario::duration;
use crate::timeline::lock;

pub use line::ImpairedLine;

/// What is done to a character.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Effect {
    /// It does not come.
    Lost,
    /// It comes twice.
    Doubled,
    /// This byte comes before it, with its right parity bit.
    Inserted(u8),
    /// This byte comes in its place, with its right parity bit.
    Replaced(u8),
    /// These of its bits are inverted; bit 8 is the parity bit.
    Flipped(u16),
    /// One bit is inverted, any one. The start bit: it does not come. The stop bit: a framing error.
    BitError,
    /// Its stop bit is low.
    FramingError,
    /// Samples of a bit disagree.
    Noise,
    /// Its parity bit is inverted. Without parity: nothing.
    ParityError,
    /// The receiver is not emptied before the next character is complete: that one is lost, and the receiver tells of an
    /// overrun together with this one. Nothing if there is none within [`OVERRUN_CHARACTERS`].
    Overrun,
    /// It comes this much later, and so does all that is behind it, back to back.
    Paused(#[serde(deserialize_with = "duration")] Ns),
}

/// How long a receiver is left full at most, in characters.
pub const OVERRUN_CHARACTERS: u64 = 2;

/// Which characters an impairment acts on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice {
    /// `count` of them, from number `first` on.
    Characters {
        /// Number of the first.
        first: u64,
        /// How many.
        count: u64,
    },
    /// Each with this probability, independently.
    Random {
        /// The probability.
        rate: Probability,
        /// When it acts, `[from, until)`; always when `None`.
        within: Option<(Ns, Ns)>,
    },
}

/// One impairment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Impairment {
    /// What is done.
    pub effect: Effect,
    /// To which characters.
    pub choice: Choice,
}

/// How the gateway hears what it sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Echo {
    /// From the centre of a character's stop bit as it is sent to the one as it is heard.
    pub delay: Ns,
    /// What echoes.
    pub by: Echoer,
}

/// What echoes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Echoer {
    /// The line, an adapter, a radio: each character as it is.
    #[default]
    Line,
    /// A port of a computer in canonical mode (POSIX.1 `ICRNL`, `ECHO`, `ECHOCTL`, `ONLCR`): CR and LF come back as CR LF,
    /// other control characters but the tab as `^` and a letter.
    Terminal,
}

impl Echoer {
    /// What comes back of a byte.
    fn echo(self, byte: u8) -> ([u8; 2], usize) {
        match (self, byte) {
            (Echoer::Terminal, b'\r' | b'\n') => (*b"\r\n", 2),
            (Echoer::Terminal, 0x7f | 0..=0x08 | 0x0b..=0x1f) => ([b'^', byte ^ 0x40], 2),
            _ => ([byte, 0], 1),
        }
    }
}

/// Which character something was done to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Character {
    /// The far end's, by its number.
    Sent(u64),
    /// One of an echo.
    Echo,
}

/// Something that was done to a character.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Impaired {
    /// When the character would have come.
    pub at: Ns,
    /// Which it was.
    pub character: Character,
    /// What it was.
    pub word: u16,
    /// The effect. In place of [`Effect::BitError`] its result.
    pub effect: Effect,
}

/// What an impaired line does, and what it has done.
#[derive(Debug, Default)]
pub struct Impairments {
    list: Vec<Impairment>,
    echo: Option<Echo>,
    /// Characters that the far end has sent.
    sent: u64,
    log: Vec<Impaired>,
}

impl Impairments {
    /// One more.
    pub fn add(&mut self, impairment: Impairment) {
        self.list.push(impairment);
    }

    /// None any more; the echo stays.
    pub fn clear(&mut self) {
        self.list.clear();
    }

    /// The echo of what the gateway sends from now on; none with `None`.
    pub fn set_echo(&mut self, echo: Option<Echo>) {
        self.echo = echo;
    }

    /// Characters that have come from the far end so far: the number of the next one.
    pub fn characters(&self) -> u64 {
        self.sent
    }

    /// What was done so far, in order.
    pub fn log(&self) -> &[Impaired] {
        &self.log
    }
}

/// Impairments that the host and the line share.
#[derive(Clone, Debug, Default)]
pub struct SharedImpairments(Arc<Mutex<Impairments>>);

impl SharedImpairments {
    /// Access to them; not to be held while the board runs.
    pub fn lock(&self) -> MutexGuard<'_, Impairments> {
        lock(&self.0)
    }
}

impl fmt::Display for Effect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Effect::Lost => "lost",
            Effect::Doubled => "doubled",
            Effect::Inserted(byte) => return write!(f, "inserted={byte:02x}"),
            Effect::Replaced(byte) => return write!(f, "replaced={byte:02x}"),
            Effect::Flipped(mask) => return write!(f, "flipped={mask:03x}"),
            Effect::BitError => "bit_error",
            Effect::FramingError => "framing_error",
            Effect::Noise => "noise",
            Effect::ParityError => "parity_error",
            Effect::Overrun => "overrun",
            Effect::Paused(ns) => return write!(f, "paused={ns}"),
        })
    }
}

impl fmt::Display for Impaired {
    /// The number of the character, or `echo`; the character; what was done.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.character {
            Character::Sent(number) => write!(f, "{number}")?,
            Character::Echo => f.write_str("echo")?,
        }
        write!(f, " {:02x} {}", self.word, self.effect)
    }
}
