//! How a slot moves: its rate the shorter way round, and how many turns it has made.
//!
//! Limits: half a turn from one angle to the next; beyond that the way is not known. Turns are counted from the first
//! angle, so that the published angle plus 360° for every turn is the unwrapped angle. The rate is that of the angles
//! before they are rounded for publication.

use clino_bus::Instant;
use clino_codec::angle::{Angle, Range};

use super::maths::step;
use crate::stamp::Stamp;
use crate::value::Published;

/// Micro-degrees in half a turn.
const HALF_TURN: i64 = 180_000_000;
/// Micro-degrees a microsecond to millidegrees a second.
const MDEG_PER_S: i64 = 1_000;

/// The last angle and how it was reached.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Motion {
    /// In any range.
    angle: Angle,
    /// In 0.001°/s.
    pub rate: i32,
    /// Whole turns since the first angle; wraps.
    pub turns: i32,
    at: Stamp,
    begun: bool,
}

impl Motion {
    /// Takes the next angle, to be published in `range`, which has to be the same every time. After a `gap` there is no
    /// rate.
    pub fn take(&mut self, angle: Angle, range: Range, at: Instant, gap: bool) {
        if self.begun {
            let step = step(self.angle, angle);
            self.rate = if gap { 0 } else { rate(step, self.at.micros_ago(at)) };
            // The published angles differ from the step by whole turns, and by what was rounded.
            let udeg = |angle: Angle| i64::from(Published::new(angle, range).angle().udeg());
            let across = udeg(self.angle).saturating_add(step.into()).saturating_sub(udeg(angle));
            self.turns = self.turns.wrapping_add(match across {
                HALF_TURN.. => 1,
                across if across <= -HALF_TURN => -1,
                _ => 0,
            });
        }
        (self.angle, self.at, self.begun) = (angle, Stamp::of(at), true);
    }

    /// The angle as it is published.
    pub fn published(&self, range: Range) -> Published {
        Published::new(self.angle, range)
    }

    /// Whether there was an angle.
    pub fn has_begun(&self) -> bool {
        self.begun
    }
}

/// Millidegrees a second of a step that took `us` microseconds, towards zero; as far as the number goes.
fn rate(step_udeg: i32, us: u64) -> i32 {
    let span = i64::try_from(us).unwrap_or(i64::MAX).max(1);
    let rate = i64::from(step_udeg).saturating_mul(MDEG_PER_S).checked_div(span).unwrap_or(0);
    i32::try_from(rate).unwrap_or(if rate < 0 { i32::MIN } else { i32::MAX })
}
