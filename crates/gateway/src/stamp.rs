//! An instant in 48 bits, of which 48 slots keep several each. With the fields beside it, it takes no more memory than
//! one of 32 bits.
//!
//! A stamp is the low 48 bits of an instant. A reader passes the time `now`, and gets the one instant with these
//! bits between [`FUTURE`] ahead and the rest of 2^48 µs ago. So every age up to 8.9 years is exact, and
//! an older one is never taken for an instant to come. The longest span that a setting allows is
//! [an hour](crate::settings::slot::LONGEST_STALE).

use clino_bus::{Duration, Instant};

/// Instants that a stamp can tell apart: 2^48 µs.
const ROUND: u64 = 1 << 48;
/// How far ahead of the clock an instant may lie that is kept as a stamp: a refresh of an ISU and less, with room.
const FUTURE: u64 = 1 << 32;
/// The greatest age that a stamp holds, µs.
#[cfg(test)]
pub(crate) const LONGEST_AGE: u64 = ROUND - FUTURE - 1;

/// The low 48 bits of an instant, in three parts, which need no room for alignment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Stamp([u16; 3]);

impl Stamp {
    /// What is kept of an instant.
    pub const fn of(at: Instant) -> Stamp {
        let us = at.as_micros();
        Stamp([us as u16, (us >> 16) as u16, (us >> 32) as u16])
    }

    /// The instant, as seen at `now`.
    pub const fn near(self, now: Instant) -> Instant {
        let ahead = self.bits().wrapping_sub(now.as_micros()) % ROUND;
        if ahead <= FUTURE {
            return Instant::from_micros(now.as_micros().saturating_add(ahead));
        }
        Instant::from_micros(now.as_micros().saturating_sub(ROUND.saturating_sub(ahead)))
    }

    /// How long ago the instant was at `now`, in µs; zero while it is still to come.
    pub const fn micros_ago(self, now: Instant) -> u64 {
        now.micros_since(self.near(now))
    }

    const fn bits(self) -> u64 {
        let Stamp([low, middle, high]) = self;
        low as u64 | (middle as u64) << 16 | (high as u64) << 32
    }
}

/// The low 24 bits of an instant, for what is looked at soon: the one instant with these bits between a second ahead of the
/// clock and 15 s ago.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ShortStamp([u8; 3]);

/// Instants that a short stamp can tell apart: 2^24 µs, 16.8 s.
const SHORT_ROUND: u32 = 1 << 24;
/// How far ahead an instant may lie that is kept as a short stamp: what happens while a queue is emptied, with room; µs.
const SHORT_FUTURE: u32 = 1 << 20;

impl ShortStamp {
    /// What is kept of an instant.
    pub const fn of(at: Instant) -> ShortStamp {
        let [low, middle, high, ..] = at.as_micros().to_le_bytes();
        ShortStamp([low, middle, high])
    }

    /// The instant, as seen at `now`.
    pub fn near(self, now: Instant) -> Instant {
        let ShortStamp([low, middle, high]) = self;
        let latest = now + Duration::from_micros(SHORT_FUTURE);
        let before = (latest.as_micros() as u32).wrapping_sub(u32::from_le_bytes([low, middle, high, 0]));
        latest - Duration::from_micros(before % SHORT_ROUND)
    }
}

/// A number in two parts, for a place beside a stamp.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Halves([u16; 2]);

impl Halves {
    /// What is kept of a number: all of it.
    pub const fn of(number: i32) -> Halves {
        let bits = number.cast_unsigned();
        Halves([bits as u16, (bits >> 16) as u16])
    }

    /// The number.
    pub const fn get(self) -> i32 {
        let Halves([low, high]) = self;
        (low as u32 | (high as u32) << 16).cast_signed()
    }
}

#[cfg(test)]
mod tests;
