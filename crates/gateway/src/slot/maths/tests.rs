//! The maths against expected values from the unwrapped angles: `i128`, and floating point for the vector mean.

use super::super::filter::Window;
use super::super::motion::Motion;
use super::*;
use crate::config::{Filter, MOST_SAMPLES};
use clino_bus::Instant;
use clino_codec::angle::Range;
use proptest::prelude::*;
use std::vec::Vec;

const TURN: i128 = 360_000_000;

/// The angle on the circle, -180° to 180°.
fn wrapped(unwrapped: i128) -> i32 {
    let positive = unwrapped.rem_euclid(TURN);
    i32::try_from(if positive >= TURN / 2 { positive - TURN } else { positive }).unwrap()
}

fn angle(unwrapped: i128) -> Angle {
    Angle::from_udeg(wrapped(unwrapped))
}

/// Any angle as sensors may send it: up to 360° either way.
fn any_angle() -> impl Strategy<Value = i128> {
    -TURN..TURN
}

/// A point of the circle and angles within a quarter of a turn of it: none is half a turn from another.
fn cluster() -> impl Strategy<Value = (i128, Vec<i128>)> {
    (any_angle(), prop::collection::vec(-TURN / 4 + 1..TURN / 4, 1..=MOST_SAMPLES))
}

/// What the last one of these angles is filtered to.
fn filtered(filter: Filter, centre: i128, offsets: &[i128]) -> Angle {
    let mut window = Window::EMPTY;
    let take = |offset| window.filtered(angle(centre + offset), filter, MOST_SAMPLES as u8);
    offsets.iter().map(take).last().unwrap()
}

fn mean(centre: i128, offsets: &[i128]) -> Angle {
    filtered(Filter::Mean, centre, offsets)
}

fn median(centre: i128, offsets: &[i128]) -> Angle {
    filtered(Filter::Median, centre, offsets)
}

/// How far apart two angles are, in µ°.
fn apart(one: Angle, other: i128) -> i128 {
    let difference = (i128::from(one.udeg()) - other).rem_euclid(TURN);
    difference.min(TURN - difference)
}

proptest! {
    #[test]
    fn a_step_is_the_shorter_way(from in any_angle(), to in any_angle()) {
        let step = i128::from(step(Angle::from_udeg(from as i32), Angle::from_udeg(to as i32)));
        prop_assert!((-TURN / 2..TURN / 2).contains(&step));
        prop_assert_eq!((from + step - to).rem_euclid(TURN), 0);
    }

    #[test]
    fn soft_zero_and_direction(raw in any_angle(), zero in any_angle()) {
        let (raw_angle, zero_angle) = (Angle::from_udeg(raw as i32), Angle::from_udeg(zero as i32));
        prop_assert_eq!(oriented(raw_angle, zero_angle, Direction::Normal).udeg(), wrapped(raw - zero));
        prop_assert_eq!(oriented(raw_angle, zero_angle, Direction::Reversed).udeg(), wrapped(zero - raw));
        prop_assert_eq!(oriented(zero_angle, zero_angle, Direction::Reversed), Angle::ZERO);
    }

    #[test]
    fn the_mean_is_that_of_the_unwrapped_angles((centre, offsets) in cluster()) {
        let sum: i128 = offsets.iter().sum();
        // Twice the distance to the exact mean is at most one: half a micro-degree of rounding.
        let n = offsets.len() as i128;
        let mean = mean(centre, &offsets);
        let error = ((i128::from(mean.udeg()) - centre) * n - sum).rem_euclid(TURN * n);
        prop_assert!(2 * error.min(TURN * n - error) <= n, "{mean:?}");
    }

    #[test]
    fn the_mean_of_close_angles_is_that_of_their_directions(
        centre in any_angle(),
        offsets in prop::collection::vec(-5_000_000_i128..5_000_000, 1..=MOST_SAMPLES),
    ) {
        let radians = |udeg: i128| (udeg as f64 / TURN as f64) * core::f64::consts::TAU;
        let (y, x) = offsets.iter().map(|offset| radians(centre + offset).sin_cos())
            .fold((0.0, 0.0), |(y, x), (sin, cos)| (y + sin, x + cos));
        let vector = (y.atan2(x) / core::f64::consts::TAU * TURN as f64).round() as i128;
        // Within 5° of each other, the two means differ by a third of the cube of that: 0.013°.
        prop_assert!(apart(mean(centre, &offsets), vector) <= 13_000);
    }

    #[test]
    fn the_median_is_that_of_the_unwrapped_angles((centre, offsets) in cluster()) {
        let mut sorted = offsets.clone();
        sorted.sort_unstable();
        let twice = sorted[(sorted.len() - 1) / 2] + sorted[sorted.len() / 2];
        let median = i128::from(median(centre, &offsets).udeg());
        let error = (2 * (median - centre) - twice).rem_euclid(2 * TURN);
        prop_assert!(error.min(2 * TURN - error) <= 1, "{median}");
    }

    #[test]
    fn one_outlier_among_three_does_not_move_the_median(centre in any_angle(), outlier in any_angle(), at in 0usize..3) {
        let mut offsets = [0_i128; 3];
        // Half a turn away is neither side.
        prop_assume!(outlier.rem_euclid(TURN) != TURN / 2);
        offsets[at] = outlier;
        prop_assert_eq!(median(centre, &offsets).udeg(), wrapped(centre));
    }

    #[test]
    fn a_window_keeps_the_newest(samples in 1_u8..=MOST_SAMPLES as u8, old in any_angle(), new in any_angle()) {
        for filter in [Filter::Mean, Filter::Median] {
            let mut window = Window::EMPTY;
            let mut take = |unwrapped| window.filtered(angle(unwrapped), filter, samples);
            (0..MOST_SAMPLES).for_each(|_| _ = take(old));
            let last = (0..samples).map(|_| take(new)).last();
            prop_assert_eq!(last.map(Angle::udeg), Some(wrapped(new)));
        }
    }

    /// In steps of a µ°, which the published angle does not show: it is the true one, rounded.
    #[test]
    fn turns_and_angle_are_the_unwrapped_angle(
        start in any_angle(),
        steps in prop::collection::vec(prop_oneof![-TURN / 2..TURN / 2, -3_000..3_000_i128], 1..200),
        unidirectional in any::<bool>(),
    ) {
        let range = if unidirectional { Range::Unidirectional } else { Range::Bidirectional };
        let mut motion = Motion::default();
        let unwrapped = |motion: &Motion| {
            i128::from(motion.turns) * TURN + 1_000 * i128::from(motion.published(range).mdeg())
        };
        let mut true_angle = start;
        motion.take(angle(start), range, Instant::from_micros(0), false);
        // The first angle is published within its range: whole turns from the true one, but for what was rounded.
        let whole = unwrapped(&motion) - start;
        let whole = (whole + TURN / 2).div_euclid(TURN) * TURN;
        for (n, step) in (1..).zip(steps) {
            true_angle += step;
            motion.take(angle(true_angle), range, Instant::from_micros(n * 20_000), false);
            prop_assert!((unwrapped(&motion) - whole - true_angle).abs() <= 500, "{motion:?}");
            // Millidegrees a second: µ° a µs, times a thousand; towards zero.
            prop_assert_eq!(i128::from(motion.rate), step * 1_000 / 20_000);
        }
    }

    #[test]
    fn a_rate_beyond_all_numbers_is_the_largest_one(step in 3_000_000_i128..TURN / 2, span in 0_u64..2) {
        let mut motion = Motion::default();
        motion.take(Angle::ZERO, Range::Bidirectional, Instant::from_micros(10), false);
        motion.take(angle(step), Range::Bidirectional, Instant::from_micros(10 + span), false);
        prop_assert_eq!(motion.rate, i32::MAX);
        motion.take(Angle::ZERO, Range::Bidirectional, Instant::from_micros(10 + 2 * span), false);
        prop_assert_eq!(motion.rate, i32::MIN);
    }
}

#[test]
fn the_seam_is_no_step() {
    let mut motion = Motion::default();
    motion.take(Angle::from_udeg(179_000_000), Range::Bidirectional, Instant::from_micros(0), false);
    motion.take(Angle::from_udeg(-179_000_000), Range::Bidirectional, Instant::from_micros(1_000_000), false);
    assert_eq!((motion.rate, motion.turns), (2_000, 1));
    motion.take(Angle::from_udeg(179_000_000), Range::Bidirectional, Instant::from_micros(2_000_000), false);
    assert_eq!((motion.rate, motion.turns), (-2_000, 0));
    assert_eq!(mean(180_000_000, &[-1_000_000, 1_000_000]), Angle::from_udeg(-180_000_000));
}

/// Where a 32-bit count of µs turns negative and where it comes round, where one of ms comes round; a year; and the
/// longest period that can be set.
const SPANS: [u64; 5] = [1 << 31, 1 << 32, 1_000 << 32, 365 * 86_400_000_000, 1_200_000_000];

#[test]
fn a_rate_over_any_span_is_that_of_the_true_angles() {
    for span in SPANS.into_iter().flat_map(|span| [span - 1, span, span + 1]) {
        for (step, begin) in
            [100_000, -100_000, 179_000_000_i128].into_iter().flat_map(|step| [(step, 0), (step, span)])
        {
            let mut motion = Motion::default();
            motion.take(Angle::ZERO, Range::Bidirectional, Instant::from_micros(begin), false);
            motion.take(angle(step), Range::Bidirectional, Instant::from_micros(begin + span), false);
            assert_eq!(i128::from(motion.rate), step * 1_000 / i128::from(span), "{step} in {span} us");
        }
    }
}
