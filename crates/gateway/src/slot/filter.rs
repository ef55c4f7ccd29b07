//! Mean and median on the circle.
//!
//! Both look at the angles from the newest one, the shorter way round, and are right as long as all of them lie within
//! half a turn of it; a sensor that turns faster than that within a few readings has no mean. For such angles the mean
//! is the point from which the squared distances along the circle are least, without a sine in it.

use clino_codec::angle::Angle;

use super::maths::step;
use crate::config::{Filter, MOST_SAMPLES};

/// The last few angles of a slot before the one that is filtered.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Window {
    /// Newest first; [`NONE`] behind the oldest.
    earlier: [Angle; MOST_SAMPLES - 1],
}

/// No angle: no sensor turns that far.
const NONE: Angle = Angle::from_udeg(i32::MIN);

impl Window {
    /// There was no angle yet.
    pub const EMPTY: Window = Window { earlier: [NONE; MOST_SAMPLES - 1] };

    /// An angle, filtered with those before it: the last `samples` count. It is kept, to count for the next ones.
    pub fn filtered(&mut self, angle: Angle, filter: Filter, samples: u8) -> Angle {
        if filter == Filter::Off {
            return angle;
        }
        // As turns from the newest, in µ°.
        let mut offsets = [0; MOST_SAMPLES];
        let mut count = 0;
        let mut carried = angle;
        // One by one: a rotation would be the only user of the 1.5 KB of `memmove`.
        for (place, offset) in self.earlier.iter_mut().zip(offsets.iter_mut().skip(1)) {
            *offset = step(angle, *place);
            core::mem::swap(place, &mut carried);
            count = usize::from(carried != NONE).saturating_add(count);
        }
        let offsets = offsets.get(..=count.min(usize::from(samples).saturating_sub(1))).unwrap_or(&[]);
        let offset = if filter == Filter::Mean { mean(offsets) } else { median(offsets) };
        Angle::from_udeg(step(Angle::from_udeg(offset.saturating_neg()), angle))
    }
}

/// The mean, rounded half away from zero.
fn mean(offsets: &[i32]) -> i32 {
    let sum = offsets.iter().fold(0, |sum: i64, &offset| sum.saturating_add(offset.into()));
    rounded(sum, offsets.len() as i64)
}

/// The median; of an even number, the mean of the middle two.
fn median(offsets: &[i32]) -> i32 {
    let (below, above) = (offsets.len().saturating_sub(1) / 2, offsets.len() / 2);
    rounded(i64::from(ranked(offsets, below)).saturating_add(ranked(offsets, above).into()), 2)
}

/// The offset that has `rank` others below it.
fn ranked(offsets: &[i32], rank: usize) -> i32 {
    let is_ranked = |&&offset: &&i32| {
        let below = offsets.iter().filter(|&&other| other < offset).count();
        let not_above = offsets.iter().filter(|&&other| other <= offset).count();
        (below..not_above).contains(&rank)
    };
    offsets.iter().find(is_ranked).copied().unwrap_or(0)
}

/// A quotient, rounded half away from zero; no offset is beyond half a turn.
fn rounded(sum: i64, n: i64) -> i32 {
    let half = if sum < 0 { n.saturating_neg() / 2 } else { n / 2 };
    let quotient = sum.saturating_add(half).checked_div(n).unwrap_or(0);
    i32::try_from(quotient).unwrap_or(0)
}
