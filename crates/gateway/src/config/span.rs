//! A span of time in half the room of [`Micros`]: 48 slots have several each.

use clino_bus::Micros;

/// A span of up to 71 minutes, in whole microseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Span(u32);

impl Span {
    /// No time at all.
    pub const ZERO: Span = Span(0);

    /// So many microseconds.
    pub const fn from_micros(us: u32) -> Span {
        Span(us)
    }

    /// So many milliseconds; at most the longest span.
    pub const fn from_millis(ms: u32) -> Span {
        Span(ms.saturating_mul(1_000))
    }

    /// In microseconds.
    pub const fn as_micros(self) -> u32 {
        self.0
    }

    /// So many times as long; at most the longest span.
    #[must_use]
    pub const fn times(self, n: u32) -> Span {
        Span(self.0.saturating_mul(n))
    }

    /// The longer of two.
    #[must_use]
    pub const fn longer(self, other: Span) -> Span {
        if self.0 < other.0 { other } else { self }
    }
}

impl From<Span> for Micros {
    fn from(span: Span) -> Micros {
        Micros(span.0.into())
    }
}

/// `None` when it is too long.
impl TryFrom<Micros> for Span {
    type Error = core::num::TryFromIntError;
    fn try_from(span: Micros) -> Result<Span, Self::Error> {
        u32::try_from(span.0).map(Span)
    }
}
