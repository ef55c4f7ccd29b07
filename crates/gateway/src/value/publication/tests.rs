//! Whole millidegrees, within their range, nearest to the angle: against 64-bit arithmetic that rounds on the circle.
//!
//! What the views make of them is in `crates/modbus/tests/views.rs`.

use super::*;
use proptest::prelude::*;

/// Micro-degrees in a turn.
const TURN_UDEG: i64 = 360_000_000;

#[track_caller]
fn check(udeg: i32, range: Range) {
    let mdeg = Published::new(Angle::from_udeg(udeg), range).mdeg();
    let allowed = if range == Range::Unidirectional { 0..=359_999 } else { -180_000..=179_999 };
    assert!(allowed.contains(&mdeg), "{udeg} is published as {mdeg}");
    let off = (i64::from(mdeg) * 1_000 - i64::from(udeg)).rem_euclid(TURN_UDEG);
    assert!(off.min(TURN_UDEG - off) <= 500, "{udeg} is published as {mdeg}");
}

#[test]
fn around_every_seam_the_angle_stays_in_its_range() {
    for seam in [-720_000_000_i64, -360_000_000, -180_000_000, 0, 180_000_000, 360_000_000, 720_000_000] {
        for near in -3_000..=3_000 {
            let udeg = (seam + near) as i32;
            check(udeg, Range::Unidirectional);
            check(udeg, Range::Bidirectional);
        }
    }
    [i32::MIN, i32::MAX].into_iter().for_each(|udeg| check(udeg, Range::Unidirectional));
}

#[test]
fn the_end_of_a_range_is_the_beginning_of_the_next_turn() {
    for (udeg, unidirectional, bidirectional) in [
        // ISU code 2 less a soft zero of 0.011°.
        (-14, "0.000", "0.000"),
        (359_999_499, "359.999", "-0.001"),
        (359_999_500, "0.000", "0.000"),
        (359_999_999, "0.000", "0.000"),
        (179_999_499, "179.999", "179.999"),
        (179_999_500, "180.000", "-180.000"),
        (-180_000_000, "180.000", "-180.000"),
    ] {
        let text = |range| std::format!("{}", Published::new(Angle::from_udeg(udeg), range));
        assert_eq!(text(Range::Unidirectional), unidirectional, "{udeg}");
        assert_eq!(text(Range::Bidirectional), bidirectional, "{udeg}");
    }
}

#[test]
fn what_a_sensor_says_stays_as_it_counts() {
    for (udeg, mdeg) in [
        (-180_000_000, -180_000),
        (-1_000, -1),
        (179_999_000, 179_999),
        (359_999_000, 359_999),
        // The last ISU code, and the end of the PWM law's range.
        (359_994_507, 359_995),
        (359_999_999, 0),
        (359_999_500, 0),
    ] {
        assert_eq!(Published::of_sensor(Angle::from_udeg(udeg)).mdeg(), mdeg, "{udeg}");
    }
}

#[test]
fn an_unwrapped_angle_that_does_not_fit_is_none() {
    let published = Published::from_mdeg(359_999);
    assert_eq!(published.unwrapped(5_964), Some(5_964 * 360_000 + 359_999));
    for (turns, fits) in
        [(5_965, false), (-5_965, true), (-5_966, false), (i32::MAX, false), (i32::MIN, false)]
    {
        assert_eq!(published.unwrapped(turns).is_some(), fits, "{turns}");
    }
    // The least of all numbers stands for "none" in the map: no angle is it.
    assert_eq!(Published::from_mdeg(0).unwrapped(-5_965), Some(-2_147_400_000));
}

proptest! {
    #[test]
    fn any_angle(udeg in any::<i32>(), unidirectional in any::<bool>()) {
        check(udeg, if unidirectional { Range::Unidirectional } else { Range::Bidirectional });
    }
}
