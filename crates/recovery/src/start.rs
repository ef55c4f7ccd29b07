//! The start as it is reported.

use core::fmt;

use crate::cause::StartCause;
use crate::crash::Crash;

/// A crash this soon after the start is a fast one: half a minute, in which every slot was read many times.
pub const FAST_MS: u32 = 30_000;

/// How long safe mode lasts before the gateway tries again: long enough for a technician at the console, short enough for a bridge.
pub const SAFE_MODE_MS: u32 = 600_000;

/// Fast crashes in a row after which only the console and the Modbus port are served.
pub(crate) const SAFE_AFTER: u8 = 3;
/// Fast crashes in a row after which nothing stored is read.
pub(crate) const BARE_AFTER: u8 = 6;

/// What is started.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Mode {
    /// Everything.
    #[default]
    Normal = 0,
    /// The console and the Modbus port.
    Safe = 1,
    /// The same, with the configuration as delivered.
    Bare = 2,
}

impl Mode {
    /// All of them, by number, with their meanings.
    pub const ALL: [(Mode, &'static str); 3] = [
        (Mode::Normal, "everything is started"),
        (Mode::Safe, "after three fast crashes in a row: the console and the Modbus port, no bus"),
        (Mode::Bare, "after six: the same, with the configuration as delivered"),
    ];

    /// Its name in JSON and in the documentation.
    pub const fn name(self) -> &'static str {
        match self {
            Mode::Normal => "normal",
            Mode::Safe => "safe",
            Mode::Bare => "bare",
        }
    }

    pub(crate) const fn after(fast_crashes: u8) -> Mode {
        match fast_crashes {
            0..SAFE_AFTER => Mode::Normal,
            SAFE_AFTER..BARE_AFTER => Mode::Safe,
            _ => Mode::Bare,
        }
    }
}

/// What time is measured with, and bit rates are made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Clock {
    /// The crystal.
    #[default]
    Crystal = 0,
    /// The internal oscillator, because the crystal did not start.
    Internal = 1,
    /// The internal oscillator, because the crystal has stopped since power-up.
    Fallback = 2,
}

impl Clock {
    /// All of them, by number, with their meanings.
    pub const ALL: [(Clock, &'static str); 3] = [
        (Clock::Crystal, "the crystal"),
        (Clock::Internal, "the internal oscillator, because the crystal did not start"),
        (Clock::Fallback, "the internal oscillator, because the crystal has stopped since power-up"),
    ];

    /// Its name in JSON and in the documentation.
    pub const fn name(self) -> &'static str {
        match self {
            Clock::Crystal => "crystal",
            Clock::Internal => "internal",
            Clock::Fallback => "fallback",
        }
    }

    /// Whether bit rates are as exact as the documents of the sensors expect.
    pub const fn is_exact(self) -> bool {
        matches!(self, Clock::Crystal)
    }
}

/// The number of the chip: 96 bits that no other one has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Uid(pub [u32; 3]);

/// The highest word first, 24 hexadecimal digits.
impl fmt::Display for Uid {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [low, middle, high] = self.0;
        write!(out, "{high:08x}{middle:08x}{low:08x}")
    }
}

/// Why, how often and how the gateway has started, and on which chip.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Start {
    /// What ended the time before.
    pub cause: StartCause,
    /// How often power came since the gateway was flashed for the first time; 0 if that is not known. With
    /// [`Start::boots`] it tells this start from every other one.
    pub power_ups: u32,
    /// Starts since power-up, this one included; wraps.
    pub boots: u32,
    /// How many of the times before ended in a crash; wraps.
    pub crashes: u32,
    /// What is started.
    pub mode: Mode,
    /// What time is measured with.
    pub clock: Clock,
    /// The last crash since power-up.
    pub crash: Option<Crash>,
    /// The chip that it has started on.
    pub uid: Uid,
}
