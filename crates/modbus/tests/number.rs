//! Number formats against the floating point of the machine that the tests run on.

use clino_modbus::number::{NAN, centidegrees, degrees};

/// Double precision holds a thousandth of any 32-bit number so closely that rounding it again to single precision gives
/// the nearest single: a tie would have to lie within 2^-53 of the quotient without being it, and quotients of
/// thousandths are never that near to one.
fn nearest(mdeg: i32) -> u32 {
    ((f64::from(mdeg) / 1_000.0) as f32).to_bits()
}

#[track_caller]
fn check(mdeg: i32) {
    assert_eq!(degrees(mdeg), nearest(mdeg), "{mdeg}");
}

#[test]
fn every_angle_of_eight_turns_either_way() {
    (-2_880_000..=2_880_000).for_each(check);
}

#[test]
fn powers_of_two_and_their_neighbours() {
    for exponent in 0..31 {
        for near in -2_000..=2_000 {
            check((1_i32 << exponent).saturating_add(near));
            check((-1_i32 << exponent).saturating_add(near));
        }
    }
    [i32::MIN, i32::MIN + 1, i32::MAX, i32::MAX - 1].into_iter().for_each(check);
}

/// Four thousand million of them: minutes.
#[test]
#[ignore = "takes minutes"]
fn every_number() {
    (i32::MIN..=i32::MAX).for_each(check);
}

/// Decimal text is read by code that has nothing to do with division.
#[test]
fn as_text_says() {
    for mdeg in (i32::MIN..=i32::MAX).step_by(65_537) {
        let text = format!(
            "{}{}.{:03}",
            if mdeg < 0 { "-" } else { "" },
            mdeg.unsigned_abs() / 1_000,
            mdeg.unsigned_abs() % 1_000
        );
        assert_eq!(f32::from_bits(degrees(mdeg)), text.parse::<f32>().expect("a number"), "{text}");
    }
}

#[test]
fn known_bits() {
    // 123.456 as the usual converters print it.
    assert_eq!(degrees(123_456), 0x42F6_E979);
    assert_eq!(degrees(-1_000), 0xBF80_0000);
    assert_eq!(degrees(0), 0);
    assert!(f32::from_bits(NAN).is_nan());
    assert_ne!(NAN & 0x0040_0000, 0, "quiet");
}

#[test]
fn hundredths() {
    for (mdeg, expected) in [
        (0, 0),
        (4, 0),
        (5, 1),
        (-4, 0),
        (-5, -1),
        (179_994, 17_999),
        // The end of the range is its beginning.
        (179_995, -18_000),
        (179_999, -18_000),
        (180_000, -18_000),
        (180_001, -18_000),
        (359_999, 0),
        (360_000, 0),
        (-180_000, -18_000),
        (-179_995, -18_000),
        (270_000, -9_000),
        (-3_690_000, -9_000),
        (i32::MAX, 8_365),
        (i32::MIN, -8_365),
    ] {
        assert_eq!(centidegrees(mdeg), expected, "{mdeg}");
    }
    for mdeg in -1_000_000..=1_000_000 {
        let told = i32::from(centidegrees(mdeg));
        assert!((-18_000..18_000).contains(&told));
        let off = (told * 10 - mdeg).rem_euclid(360_000);
        assert!(off <= 5 || off >= 359_995, "{mdeg}: {told}");
    }
}
