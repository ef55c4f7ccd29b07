//! The lowest and the highest angle of a slot since they were cleared, as published, and when.
//!
//! They are forgotten when the angle means something else (source, zero, direction, range, filter), and with a reset.

use clino_bus::Instant;

use crate::stamp::{Halves, Stamp};

/// An angle and when it came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Extreme {
    mdeg: Halves,
    at: Stamp,
}

/// The lowest and the highest angle of a slot. 20 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Extremes {
    lowest: Extreme,
    highest: Extreme,
}

/// An extreme and its age.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ExtremeAngle {
    /// In 0.001°, in the slot's range.
    pub mdeg: i32,
    /// Time since it came last, in milliseconds.
    pub age_ms: u64,
}

impl Extremes {
    /// There was no angle: any is lower, and any is higher.
    pub(crate) const NONE: Extremes =
        Extremes { lowest: Extreme::before_all(i32::MAX), highest: Extreme::before_all(i32::MIN) };

    /// An angle came at `at`, in 0.001°. One that is as low, or as high, as the extreme renews it.
    pub(crate) fn take(&mut self, mdeg: i32, at: Instant) {
        let now = Extreme { mdeg: Halves::of(mdeg), at: Stamp::of(at) };
        if mdeg <= self.lowest.mdeg.get() {
            self.lowest = now;
        }
        if mdeg >= self.highest.mdeg.get() {
            self.highest = now;
        }
    }

    /// The lowest angle; `None` if there was none.
    pub fn lowest(&self, now: Instant) -> Option<ExtremeAngle> {
        self.with_age(self.lowest, now)
    }

    /// The highest angle; `None` if there was none.
    pub fn highest(&self, now: Instant) -> Option<ExtremeAngle> {
        self.with_age(self.highest, now)
    }

    fn with_age(&self, extreme: Extreme, now: Instant) -> Option<ExtremeAngle> {
        (self.lowest.mdeg.get() <= self.highest.mdeg.get()).then(|| ExtremeAngle {
            mdeg: extreme.mdeg.get(),
            age_ms: now.millis_since(extreme.at.near(now)),
        })
    }
}

impl Extreme {
    const fn before_all(mdeg: i32) -> Extreme {
        Extreme { mdeg: Halves::of(mdeg), at: Stamp::of(Instant::ZERO) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn there_is_none_before_the_first_angle() {
        let extremes = Extremes::NONE;
        assert_eq!(
            (extremes.lowest(Instant::from_micros(5)), extremes.highest(Instant::from_micros(5))),
            (None, None)
        );
    }

    proptest! {
        /// Against the whole history.
        #[test]
        fn they_are_those_of_the_history(angles in prop::collection::vec(-20_i32..20, 1..40)) {
            let mut extremes = Extremes::NONE;
            for (index, &angle) in angles.iter().enumerate() {
                extremes.take(angle, Instant::from_micros(index as u64 * 1_000));
            }
            let now = Instant::from_micros(1_000_000);
            let age_ms = |of: i32| {
                let last = angles.iter().rposition(|&angle| angle == of).unwrap();
                1_000 - last as u64
            };
            let (least, most) = (*angles.iter().min().unwrap(), *angles.iter().max().unwrap());
            prop_assert_eq!(extremes.lowest(now), Some(ExtremeAngle { mdeg: least, age_ms: age_ms(least) }));
            prop_assert_eq!(extremes.highest(now), Some(ExtremeAngle { mdeg: most, age_ms: age_ms(most) }));
        }
    }
}
