//! One received UART character: the byte and what the receiver thought of it.
//!
//! The receiver's error flags travel with the byte, because discarding characters with a framing error is the
//! cheapest strong protection against line noise that an 8-bit sum leaves open.

use core::ops::{BitOr, BitOrAssign};

/// A received byte with the receiver's error flags.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Character {
    /// The data bits as sampled.
    pub byte: u8,
    /// What the receiver complained about while sampling them.
    pub errors: LineErrors,
}

impl Character {
    /// A character that was received without complaint.
    pub const fn clean(byte: u8) -> Self {
        Self { byte, errors: LineErrors::NONE }
    }
}

/// A set of UART receiver errors.
///
/// ```
/// use clino_codec::character::LineErrors;
///
/// let seen = LineErrors::FRAMING | LineErrors::NOISE;
/// assert!(seen.contains(LineErrors::NOISE));
/// assert!(!seen.contains(LineErrors::OVERRUN));
/// assert!(LineErrors::NONE.is_none());
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LineErrors(u8);

impl LineErrors {
    /// No error.
    pub const NONE: Self = Self(0);
    /// The stop bit was low.
    pub const FRAMING: Self = Self(1);
    /// Samples within one bit disagreed.
    pub const NOISE: Self = Self(1 << 1);
    /// At least one earlier character was lost because the software did not fetch it in time.
    pub const OVERRUN: Self = Self(1 << 2);
    /// The parity bit did not fit the data bits.
    pub const PARITY: Self = Self(1 << 3);

    /// Whether the set is empty.
    pub const fn is_none(self) -> bool {
        self.0 == Self::NONE.0
    }

    /// Whether every error of `other` is in this set.
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// The errors of both sets.
    #[must_use]
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// The errors of this set that are not in the other.
    #[must_use]
    pub const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// The errors of all these sets.
    #[inline(never)]
    pub(crate) fn all(sets: &[Self]) -> Self {
        sets.iter().fold(Self::NONE, |all, &one| all | one)
    }
}

impl BitOr for LineErrors {
    type Output = Self;

    fn bitor(self, other: Self) -> Self {
        self.union(other)
    }
}

impl BitOrAssign for LineErrors {
    fn bitor_assign(&mut self, other: Self) {
        *self = self.union(other);
    }
}
