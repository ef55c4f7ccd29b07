//! Mean and median on the circle.
//!
//! Both look at the angles from the newest one, the shorter way round, and are right as long as all of them lie within
//! half a turn of it; a sensor that turns faster than that within a few readings has no mean. For such angles the mean
//! is the point from which the squared distances along the circle are least, without a sine in it.

use clino_codec::angle::Angle;

use super::maths::step;
use crate::config::MOST_SAMPLES;

/// The last few angles of a slot.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Window {
    /// Newest first.
    samples: [Angle; MOST_SAMPLES],
    filled: u8,
}

impl Window {
    /// Forgets all.
    pub fn clear(&mut self) {
        self.filled = 0;
    }

    /// Takes an angle, and keeps the last `samples`.
    pub fn push(&mut self, angle: Angle, samples: u8) {
        // One by one: a rotation would be the only user of the 1.5 KB of `memmove`.
        let mut carried = angle;
        self.samples.iter_mut().for_each(|sample| core::mem::swap(sample, &mut carried));
        self.filled = self.filled.saturating_add(1).min(samples.clamp(1, MOST_SAMPLES as u8));
    }

    /// The mean, rounded half away from zero as seen from the newest.
    pub fn mean(&self) -> Angle {
        let sum: i64 = self.offsets().map(i64::from).fold(0, i64::saturating_add);
        self.off_newest(rounded(sum, self.filled.max(1).into()))
    }

    /// The median; of an even number, the mean of the middle two.
    pub fn median(&self) -> Angle {
        let (below, above) = (self.filled.saturating_sub(1) / 2, self.filled / 2);
        let sum = i64::from(self.ranked(below)).saturating_add(self.ranked(above).into());
        self.off_newest(rounded(sum, 2))
    }

    /// The offset that has `rank` others below it.
    fn ranked(&self, rank: u8) -> i32 {
        let is_ranked = |&offset: &i32| {
            let below = self.offsets().filter(|&other| other < offset).count();
            let not_above = self.offsets().filter(|&other| other <= offset).count();
            (below..not_above).contains(&rank.into())
        };
        self.offsets().find(is_ranked).unwrap_or(0)
    }

    /// The angles, as turns from the newest, in µ°.
    fn offsets(&self) -> impl Iterator<Item = i32> {
        let newest = self.newest();
        let kept = self.samples.iter().take(self.filled.into());
        kept.map(move |angle| step(newest, *angle))
    }

    fn newest(&self) -> Angle {
        self.samples.first().copied().unwrap_or_default()
    }

    fn off_newest(&self, offset: i32) -> Angle {
        Angle::from_udeg(step(Angle::from_udeg(offset.saturating_neg()), self.newest()))
    }
}

/// A quotient, rounded half away from zero; no offset is beyond half a turn.
fn rounded(sum: i64, n: i64) -> i32 {
    let half = if sum < 0 { n.saturating_neg() / 2 } else { n / 2 };
    let quotient = sum.saturating_add(half).checked_div(n).unwrap_or(0);
    i32::try_from(quotient).unwrap_or(0)
}
