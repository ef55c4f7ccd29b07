//! The numbers of T7 messages, raw as sent, each with its one way to a common unit. Source: T7 guide §1,
//! §2.1.1.

use crate::angle::{Angle, Range};
use crate::checks::ValueRange;

/// Lowest angle of either output mode. Source: §1.
const MIN_MDEG: i32 = -180_000;
/// Highest angle of the bidirectional mode. Source: §1.
const MAX_BIDIRECTIONAL_MDEG: i32 = 179_999;
/// Highest angle of the unidirectional mode. Source: §1.
const MAX_UNIDIRECTIONAL_MDEG: i32 = 359_999;

/// An angle or offset as sent: degrees × 1000, any 32-bit number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Millidegrees(pub i32);

impl Millidegrees {
    /// Lowest angle of either output mode: −180.000°.
    pub const MIN: Self = Self(MIN_MDEG);
    /// Highest angle of either output mode: 359.999°.
    pub const MAX: Self = Self(MAX_UNIDIRECTIONAL_MDEG);

    /// The angle; `None` only for numbers far outside any output range (beyond ±2147.483°).
    pub const fn angle(self) -> Option<Angle> {
        Angle::from_mdeg(self.0)
    }

    /// Whether a device in this output mode can report the angle.
    pub const fn is_in(self, mode: Range) -> bool {
        match mode {
            Range::Bidirectional => self.0 >= MIN_MDEG && self.0 <= MAX_BIDIRECTIONAL_MDEG,
            Range::Unidirectional => self.0 >= 0 && self.0 <= MAX_UNIDIRECTIONAL_MDEG,
        }
    }

    /// Whether a device in one of the two output modes can report the angle.
    pub const fn is_in_any(self) -> bool {
        self.0 >= MIN_MDEG && self.0 <= MAX_UNIDIRECTIONAL_MDEG
    }
}

impl ValueRange {
    /// Lowest and highest angle that pass this check, in millidegrees.
    #[inline(never)]
    pub(super) const fn limits(self) -> (i32, i32) {
        match self {
            Self::Off => (i32::MIN, i32::MAX),
            Self::AnyMode => (MIN_MDEG, MAX_UNIDIRECTIONAL_MDEG),
            Self::Mode(Range::Bidirectional) => (MIN_MDEG, MAX_BIDIRECTIONAL_MDEG),
            Self::Mode(Range::Unidirectional) => (0, MAX_UNIDIRECTIONAL_MDEG),
        }
    }

    /// Whether an angle passes this check.
    #[inline]
    pub(super) fn allows(self, angle: Millidegrees) -> bool {
        let (min, max) = self.limits();
        angle.0 >= min && angle.0 <= max
    }
}

/// To the nearest millidegree.
impl From<Angle> for Millidegrees {
    fn from(angle: Angle) -> Self {
        Self(angle.mdeg())
    }
}

/// A temperature as sent: °C × 100.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Temperature(pub i16);

impl Temperature {
    /// Lowest documented temperature, −5.00 °C. Source: §2.1.1.
    pub const MIN: Self = Self(-500);
    /// Highest documented temperature, 190.00 °C. Source: §2.1.1.
    pub const MAX: Self = Self(19_000);

    /// The temperature in hundredths of a degree Celsius.
    pub const fn centi_celsius(self) -> i16 {
        self.0
    }

    /// Whether it lies in the documented range.
    ///
    /// A temperature outside does not make an answer invalid: it is reported, and this tells it apart.
    pub const fn is_documented(self) -> bool {
        self.0 >= Self::MIN.0 && self.0 <= Self::MAX.0
    }
}

/// An acceleration as sent: multiples of 1/102 300 g.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Acceleration(pub i32);

impl Acceleration {
    /// Steps per g. Source: §1.
    pub const STEPS_PER_G: i32 = 102_300;

    /// The acceleration in millionths of g, rounded half away from zero.
    ///
    /// ```
    /// use clino_codec::t7::Acceleration;
    ///
    /// assert_eq!(Acceleration(51_150).micro_g(), 500_000);
    /// ```
    pub const fn micro_g(self) -> i64 {
        // Per g: 10^6 µg / 102 300 = 10 000/1023, in lowest terms.
        let scaled = self.0 as i64 * 10_000;
        let half = if scaled < 0 { -511 } else { 511 };
        (scaled + half) / 1_023
    }
}
