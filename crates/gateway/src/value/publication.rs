//! How an angle is published: rounded first, then brought into its range, once for all views.
//!
//! ```text
//!  angle, µ° ── round to 0.001° ── range ── Published ──┬── text, three decimals
//!                                                       ├── 32-bit integer, 0.001°
//!                                                       ├── binary32, degrees
//!                                                       └── 16-bit integer, 0.01°: rounded and brought into ±180° again
//! ```
//!
//! An angle just below the end of its range rounds to the end, which is the beginning of the next turn: 359.9996° is
//! 0.000°, 179.9996° is -180.000°. Rounding after the range is applied would publish 360.000°.
//!
//! | value | range |
//! |---|---|
//! | angle of a slot, unidirectional | 0 up to 359.999° |
//! | angle of a slot, bidirectional | −180.000 up to 179.999° |
//! | angle as the sensor said it: ISU, PWM | 0 up to 359.999° |
//! | angle as the sensor said it: T7 | −180.000 up to 179.999°, or 0 up to 359.999°, as it is set |

use core::fmt;

use clino_codec::angle::{Angle, Range};

/// Millidegrees per turn, and per half turn.
const TURN: i32 = 360_000;
const HALF_TURN: i32 = TURN / 2;
/// Micro-degrees per millidegree.
const UDEG_PER_MDEG: i32 = 1_000;

/// An angle as all views have it: whole millidegrees, within its range.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Published(i32);

impl Published {
    /// The angle in a slot's output range.
    pub const fn new(angle: Angle, range: Range) -> Published {
        let positive = angle.mdeg().rem_euclid(TURN);
        Published(match range {
            Range::Bidirectional if positive >= HALF_TURN => positive.wrapping_sub(TURN),
            Range::Bidirectional | Range::Unidirectional => positive,
        })
    }

    /// An angle as its sensor has said it, which counts a turn in its own way.
    #[inline(never)]
    pub const fn of_sensor(angle: Angle) -> Published {
        match angle.mdeg() {
            negative @ ..0 => Published(negative),
            positive => Published(positive.rem_euclid(TURN)),
        }
    }

    /// From [`Published::mdeg`].
    #[cfg(test)]
    pub(crate) const fn from_mdeg(mdeg: i32) -> Published {
        Published(mdeg)
    }

    /// In millidegrees.
    pub const fn mdeg(self) -> i32 {
        self.0
    }

    /// The same as an angle.
    pub const fn angle(self) -> Angle {
        Angle::from_udeg(self.0.saturating_mul(UDEG_PER_MDEG))
    }

    /// The angle plus `turns` whole turns, in millidegrees; `None` beyond 32 bits, 5 965 turns.
    pub fn unwrapped(self, turns: i32) -> Option<i32> {
        turns.checked_mul(TURN)?.checked_add(self.0)
    }
}

/// Degrees with three decimals.
impl fmt::Display for Published {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(&self.angle(), f)
    }
}

#[cfg(test)]
mod sweep;
#[cfg(test)]
mod tests;
