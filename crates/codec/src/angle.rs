//! One angle type for all sensors.
//!
//! An [`Angle`] is an `i32` count of micro-degrees (µ°). That holds each sensor's resolution:
//!
//! | sensor | resolution | in µ° | kept |
//! |---|---|---|---|
//! | T7 | 0.001° | 1000 | exactly |
//! | ISU, serial | 360/65536° | 5493.164… | to ½ µ°; the 16-bit code survives the round trip |
//! | ISU, ASCII | 0.01° | 10 000 | exactly |
//! | ISU, PWM | one step of 4.34 µs, about 0.088° | 87 890 | far finer than a step |
//!
//! Limits: ±2147.483647°, a little under six turns. Nothing here uses floating point.

mod text;

pub use text::AngleText;

/// Micro-degrees per millidegree.
const UDEG_PER_MDEG: i32 = 1_000;
/// Micro-degrees per hundredth of a degree.
const UDEG_PER_CENTIDEG: i32 = 10_000;
/// Micro-degrees per turn.
const TURN_UDEG: i32 = 360_000_000;
/// Micro-degrees per half turn.
const HALF_TURN_UDEG: i32 = TURN_UDEG / 2;
/// Steps per turn of the ISU's binary angle. Source: AN #201, table 3.
const TURN16_STEPS: u64 = 1 << 16;

/// An angle in micro-degrees.
///
/// ```
/// use clino_codec::angle::{Angle, Range};
///
/// let angle = Angle::from_mdeg(-45_313).unwrap();
/// assert_eq!(angle.udeg(), -45_313_000);
/// assert_eq!(angle.to_string(), "-45.313");
/// assert_eq!(angle.normalised(Range::Unidirectional).to_string(), "314.687");
///
/// // From 179° to −179° it is two degrees, not 358.
/// let turned = Angle::from_udeg(-179_000_000).difference(Angle::from_udeg(179_000_000));
/// assert_eq!(turned, Angle::from_udeg(2_000_000));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Angle(i32);

impl Angle {
    /// 0°.
    pub const ZERO: Self = Self(0);

    /// An angle in micro-degrees.
    pub const fn from_udeg(udeg: i32) -> Self {
        Self(udeg)
    }

    /// The angle in micro-degrees.
    pub const fn udeg(self) -> i32 {
        self.0
    }

    /// An angle in millidegrees; `None` beyond ±2 147 483 m°.
    pub const fn from_mdeg(mdeg: i32) -> Option<Self> {
        match mdeg.checked_mul(UDEG_PER_MDEG) {
            Some(udeg) => Some(Self(udeg)),
            None => None,
        }
    }

    /// The angle in millidegrees, rounded half away from zero.
    pub const fn mdeg(self) -> i32 {
        let half = if self.0 < 0 { -(UDEG_PER_MDEG / 2) } else { UDEG_PER_MDEG / 2 };
        // Half a millidegree more than the largest `i32` would overflow; round the quotient instead.
        let whole = self.0 / UDEG_PER_MDEG;
        let rest = self.0 % UDEG_PER_MDEG;
        whole + (rest + half) / UDEG_PER_MDEG
    }

    /// An angle in hundredths of a degree; `None` beyond ±214 748.
    pub const fn from_centideg(centideg: i32) -> Option<Self> {
        match centideg.checked_mul(UDEG_PER_CENTIDEG) {
            Some(udeg) => Some(Self(udeg)),
            None => None,
        }
    }

    /// The angle of an ISU code: `code · 360/65536` degrees, rounded to the nearest micro-degree.
    ///
    /// Source: AN #201, table 3.
    pub const fn from_turn16(code: u16) -> Self {
        let udeg = (code as u64 * TURN_UDEG as u64 + TURN16_STEPS / 2) / TURN16_STEPS;
        Self(udeg as i32)
    }

    /// The nearest ISU code; whole turns fall away.
    ///
    /// ```
    /// use clino_codec::angle::Angle;
    ///
    /// assert_eq!(Angle::from_turn16(0x8000), Angle::from_udeg(180_000_000));
    /// assert_eq!(Angle::from_udeg(-90_000_000).to_turn16(), 0xC000);
    /// ```
    pub const fn to_turn16(self) -> u16 {
        let udeg = self.0.rem_euclid(TURN_UDEG) as u64;
        ((udeg * TURN16_STEPS + HALF_TURN_UDEG as u64) / TURN_UDEG as u64) as u16
    }

    /// The same direction within a sensor's output range.
    #[must_use]
    pub const fn normalised(self, range: Range) -> Self {
        let positive = self.0.rem_euclid(TURN_UDEG);
        match range {
            Range::Bidirectional if positive >= HALF_TURN_UDEG => Self(positive - TURN_UDEG),
            Range::Bidirectional | Range::Unidirectional => Self(positive),
        }
    }

    /// The turn that leads from `from` to this angle the shorter way: −180° up to, not including, +180°.
    #[must_use]
    pub const fn difference(self, from: Self) -> Self {
        let to = self.0.rem_euclid(TURN_UDEG);
        let from = from.0.rem_euclid(TURN_UDEG);
        Self(to - from).normalised(Range::Bidirectional)
    }

    /// The angle as decimal text with up to six decimals, rounded half away from zero.
    ///
    /// ```
    /// use clino_codec::angle::Angle;
    ///
    /// assert_eq!(Angle::from_udeg(89_563_400).text(2).as_str(), "89.56");
    /// ```
    pub fn text(self, decimals: usize) -> AngleText {
        AngleText::new(self, decimals)
    }
}

/// The two ways a sensor can count a turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Range {
    /// −180° up to, not including, +180°.
    Bidirectional,
    /// 0° up to, not including, 360°.
    Unidirectional,
}

impl Range {
    /// The largest angle that an [`Angle`] can hold within this range.
    pub const fn last(self) -> Angle {
        match self {
            Self::Bidirectional => Angle(HALF_TURN_UDEG - 1),
            Self::Unidirectional => Angle(TURN_UDEG - 1),
        }
    }

    /// Whether the angle lies in this range.
    pub const fn contains(self, angle: Angle) -> bool {
        angle.normalised(self).0 == angle.0
    }
}
