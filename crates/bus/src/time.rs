//! Time: an [`Instant`] says when, a [`Duration`] says how long.
//!
//! An [`Instant`] has 63 bits at 1 MHz, which last 292 000 years. A [`Duration`] has 32 bits, which hold 71.58 minutes.
//! The longest waits of the settings are an hour (stale limit, report interval, alarm delay) and 20 minutes (period), so
//! every wait on a bus fits. A Cortex-M4 compares and divides 32 bits in one instruction; it divides 64 bits in a loop.
//!
//! An age has no limit. [`Instant::micros_since`] and [`Instant::millis_since`] return it in 64 bits.
//!
//! Durations, and what is subtracted from an instant, saturate. The time between two instants in the wrong order is zero,
//! which is the safe answer to "how long ago" and "how long until". The sum of an instant and a duration need not
//! saturate: no instant is made later than [`Instant::NEVER`], and above that there is room for two thousand million of the longest
//! durations.
//!
//! The 64 bits are kept as two words: a compiler for a core of 32 bits aligns them by four bytes, not eight, and passes them in two
//! registers. `docs/decisions.md` (*Own types of time*) has the figures, and says why this is not the `fugit` crate.

use core::cmp::Ordering;
use core::ops::{Add, Sub};

const MICROS_PER_MILLI: u32 = 1_000;
/// The same, for ages.
const MICROS_PER_MILLI_64: u64 = 1_000;
/// [`Instant::NEVER`] in microseconds.
const LATEST: u64 = u64::MAX >> 1;

/// An instant, in microseconds since reset.
#[derive(Clone, Copy, Default, PartialEq, Eq, Hash)]
pub struct Instant {
    low: u32,
    high: u32,
}

/// A length of time, in microseconds, of at most 71.58 minutes ([`Duration::MAX`]).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Duration(u32);

impl Instant {
    /// The reset of the chip.
    pub const ZERO: Instant = Instant::of(0);
    /// Later than any instant that is reached: 292 000 years after reset.
    pub const NEVER: Instant = Instant::of(LATEST);

    /// `us` microseconds after reset; at most [`Instant::NEVER`].
    pub const fn from_micros(us: u64) -> Instant {
        Instant::of(if us > LATEST { LATEST } else { us })
    }

    const fn of(us: u64) -> Instant {
        Instant { low: us as u32, high: (us >> u32::BITS) as u32 }
    }

    /// `ms` milliseconds after reset.
    pub const fn from_millis(ms: u32) -> Instant {
        Instant::of((ms as u64).saturating_mul(MICROS_PER_MILLI_64))
    }

    /// Microseconds since reset.
    pub const fn as_micros(self) -> u64 {
        (self.high as u64) << u32::BITS | self.low as u64
    }

    /// Time from `earlier` to `self`: zero in the wrong order, [`Duration::MAX`] for that much and more. For comparison
    /// with a limit below that; an age that is reported is [`Instant::millis_since`].
    pub const fn since(self, earlier: Instant) -> Duration {
        let us = self.micros_since(earlier);
        if us > u32::MAX as u64 { Duration::MAX } else { Duration(us as u32) }
    }

    /// Microseconds from `earlier` to `self`, without a limit; zero in the wrong order.
    pub const fn micros_since(self, earlier: Instant) -> u64 {
        self.as_micros().saturating_sub(earlier.as_micros())
    }

    /// Milliseconds from `earlier` to `self`, rounded down, without a limit; zero in the wrong order.
    pub const fn millis_since(self, earlier: Instant) -> u64 {
        let us = self.micros_since(earlier);
        // Ages of more than 71 minutes are rare: the others are divided in one instruction.
        if us > u32::MAX as u64 { long_millis(us) } else { (us as u32 / MICROS_PER_MILLI) as u64 }
    }
}

/// Milliseconds of more microseconds than 32 bits hold. A function of its own: beside the short division, the compiler would
/// make one of both, the long one.
#[cold]
#[inline(never)]
const fn long_millis(us: u64) -> u64 {
    us / MICROS_PER_MILLI_64
}

impl Duration {
    /// No time at all.
    pub const ZERO: Duration = Duration(0);
    /// The longest: 4294.967295 s.
    pub const MAX: Duration = Duration(u32::MAX);

    /// `us` microseconds.
    pub const fn from_micros(us: u32) -> Duration {
        Duration(us)
    }

    /// `ms` milliseconds; at most [`Duration::MAX`].
    pub const fn from_millis(ms: u32) -> Duration {
        Duration(ms.saturating_mul(MICROS_PER_MILLI))
    }

    /// Microseconds.
    pub const fn as_micros(self) -> u32 {
        self.0
    }

    /// Milliseconds, rounded down.
    pub const fn as_millis(self) -> u32 {
        self.0 / MICROS_PER_MILLI
    }

    /// `n` times as long; at most [`Duration::MAX`].
    #[must_use]
    pub const fn times(self, n: u32) -> Duration {
        Duration(self.0.saturating_mul(n))
    }

    /// The sum, as `+` is, for constants; at most [`Duration::MAX`].
    #[must_use]
    pub const fn plus(self, other: Duration) -> Duration {
        Duration(self.0.saturating_add(other.0))
    }

    /// The longer of two, as `max` is, for constants.
    #[must_use]
    pub const fn longer(self, other: Duration) -> Duration {
        if self.0 < other.0 { other } else { self }
    }
}

impl PartialOrd for Instant {
    fn partial_cmp(&self, other: &Instant) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Instant {
    fn cmp(&self, other: &Instant) -> Ordering {
        self.as_micros().cmp(&other.as_micros())
    }
}

impl core::fmt::Debug for Instant {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_tuple("Instant").field(&self.as_micros()).finish()
    }
}

#[cfg(feature = "defmt")]
impl defmt::Format for Instant {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "Instant({=u64})", self.as_micros());
    }
}

/// Does not overflow: see the module documentation.
impl Add<Duration> for Instant {
    type Output = Instant;
    fn add(self, duration: Duration) -> Instant {
        Instant::of(self.as_micros().wrapping_add(duration.0.into()))
    }
}

/// Saturates at [`Instant::ZERO`].
impl Sub<Duration> for Instant {
    type Output = Instant;
    fn sub(self, duration: Duration) -> Instant {
        Instant::of(self.as_micros().saturating_sub(duration.0.into()))
    }
}

/// Saturates at [`Duration::MAX`].
impl Add for Duration {
    type Output = Duration;
    fn add(self, other: Duration) -> Duration {
        self.plus(other)
    }
}

/// Saturates at [`Duration::ZERO`].
impl Sub for Duration {
    type Output = Duration;
    fn sub(self, other: Duration) -> Duration {
        Duration(self.0.saturating_sub(other.0))
    }
}

/// The earlier of two deadlines, where `None` means "never".
#[inline]
pub fn earliest(a: Option<Instant>, b: Option<Instant>) -> Option<Instant> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (a, b) => a.or(b),
    }
}

#[cfg(test)]
mod tests;
