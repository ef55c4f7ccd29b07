//! How a slot moves: its rate the shorter way round, and how many turns it has made.
//!
//! Limits: half a turn from one angle to the next; beyond that nobody can tell which way it went. Turns are counted
//! from the first angle; an angle of the output range plus 360° for every turn is the unwrapped angle.

use clino_bus::Micros;
use clino_codec::angle::Angle;

use super::step;
use crate::stamp::Stamp;

/// Micro-degrees in half a turn, and in a whole one.
const HALF_TURN: i32 = 180_000_000;
/// Micro-degrees a microsecond to millidegrees a second.
const MDEG_PER_S: i64 = 1_000;

/// The last angle and how it was reached.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Motion {
    /// In the output range of the slot.
    pub angle: Angle,
    /// In 0.001°/s.
    pub rate: i32,
    /// Whole turns since the first angle; wraps.
    pub turns: i32,
    at: Stamp,
    begun: bool,
}

impl Motion {
    /// Takes the next angle, of the same output range. After a `gap` there is no rate.
    pub fn take(&mut self, angle: Angle, at: Micros, gap: bool) {
        if self.begun {
            let step = step(self.angle, angle);
            self.rate = if gap { 0 } else { rate(step, at.since(self.at.near(at))) };
            // The direct way differs from the shorter one by a turn when the seam lies between.
            let direct = angle.udeg().saturating_sub(self.angle.udeg());
            let across = i64::from(step).saturating_sub(direct.into());
            self.turns = self.turns.wrapping_add(match across {
                across if across > HALF_TURN.into() => 1,
                across if across < HALF_TURN.saturating_neg().into() => -1,
                _ => 0,
            });
        }
        (self.angle, self.at, self.begun) = (angle, Stamp::of(at), true);
    }

    /// Whether there was an angle.
    pub fn has_begun(&self) -> bool {
        self.begun
    }
}

/// Millidegrees a second, towards zero; as far as the number goes.
fn rate(step_udeg: i32, span: Micros) -> i32 {
    let span = i64::try_from(span.0).unwrap_or(i64::MAX).max(1);
    let rate = i64::from(step_udeg).saturating_mul(MDEG_PER_S).checked_div(span).unwrap_or(0);
    i32::try_from(rate).unwrap_or(if rate < 0 { i32::MIN } else { i32::MAX })
}
