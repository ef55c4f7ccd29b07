//! Time as a count of microseconds since reset, or as a span of them.
//!
//! 64 bits at 1 MHz last 584 000 years. Arithmetic saturates: a span computed from two instants in the wrong
//! order is zero, which is the safe answer for "how long ago" and "how long until". (The `fugit` crate was
//! considered: its operators panic on overflow, and no panic may be linked into this crate.)

use core::ops::{Add, Sub};

/// An instant (microseconds since reset) or a span (microseconds).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Micros(pub u64);

impl Micros {
    /// The reset instant, and the empty span.
    pub const ZERO: Micros = Micros(0);

    /// A span of whole milliseconds.
    pub const fn from_millis(ms: u32) -> Micros {
        Micros((ms as u64).saturating_mul(1_000))
    }

    /// Whole milliseconds, rounded down.
    pub const fn as_millis(self) -> u64 {
        self.0 / 1_000
    }

    /// How far `self` lies after `earlier`; zero when it does not.
    pub const fn since(self, earlier: Micros) -> Micros {
        Micros(self.0.saturating_sub(earlier.0))
    }

    /// `self` repeated `n` times.
    pub const fn times(self, n: u64) -> Micros {
        Micros(self.0.saturating_mul(n))
    }
}

impl Add for Micros {
    type Output = Micros;
    fn add(self, span: Micros) -> Micros {
        Micros(self.0.saturating_add(span.0))
    }
}

impl Sub for Micros {
    type Output = Micros;
    fn sub(self, span: Micros) -> Micros {
        self.since(span)
    }
}

/// The earlier of two deadlines, where `None` means "never".
pub fn earliest(a: Option<Micros>, b: Option<Micros>) -> Option<Micros> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (a, b) => a.or(b),
    }
}
