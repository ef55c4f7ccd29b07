//! Angles: exact conversions, both ranges, differences, text.

use clino_codec::angle::{Angle, Range};

#[test]
fn millidegrees_are_exact_and_rounded_half_away_from_zero() {
    for mdeg in [0, 1, -1, 179_999, -180_000, 359_999, 2_147_483, -2_147_483] {
        assert_eq!(Angle::from_mdeg(mdeg).map(Angle::mdeg), Some(mdeg));
    }
    for mdeg in [2_147_484, -2_147_484, i32::MAX, i32::MIN] {
        assert_eq!(Angle::from_mdeg(mdeg), None);
    }
    for (udeg, mdeg) in [
        (499, 0),
        (500, 1),
        (-499, 0),
        (-500, -1),
        (1_499, 1),
        (1_500, 2),
        (-1_500, -2),
        (i32::MAX, 2_147_484),
        (i32::MIN, -2_147_484),
    ] {
        assert_eq!(Angle::from_udeg(udeg).mdeg(), mdeg, "{udeg}");
    }
}

#[test]
fn hundredths_are_exact() {
    assert_eq!(Angle::from_centideg(-17_999), Some(Angle::from_udeg(-179_990_000)));
    assert_eq!(Angle::from_centideg(214_749), None);
}

#[test]
fn all_65536_isu_codes_survive_and_are_within_half_a_microdegree() {
    for code in 0..=u16::MAX {
        let angle = Angle::from_turn16(code);
        assert_eq!(angle.to_turn16(), code);
        // |udeg − code·360e6/65536| ≤ ½, in 65536ths.
        let error = i64::from(angle.udeg()) * 65_536 - i64::from(code) * 360_000_000;
        assert!(error.abs() <= 32_768, "{code}");
        let whole_turn_back = Angle::from_udeg(angle.udeg() - 360_000_000);
        assert_eq!(whole_turn_back.to_turn16(), code);
    }
    // Just below a whole turn is nearest to zero.
    assert_eq!(Angle::from_udeg(359_999_999).to_turn16(), 0);
}

#[test]
fn the_resolution_is_finer_than_a_pulse_width_step() {
    // 4.34 µs of 1/30 s, times 675°: far more than a micro-degree.
    let step_udeg = 4.34e-6 * 30.0 * 675.0 * 1e6;
    assert!(step_udeg > 87_000.0);
}

#[test]
fn both_ranges() {
    for (udeg, bidirectional, unidirectional) in [
        (0, 0, 0),
        (179_999_999, 179_999_999, 179_999_999),
        (180_000_000, -180_000_000, 180_000_000),
        (-180_000_000, -180_000_000, 180_000_000),
        (-1, -1, 359_999_999),
        (359_999_999, -1, 359_999_999),
        (360_000_000, 0, 0),
        (i32::MAX, -12_516_353, 347_483_647),
        (i32::MIN, 12_516_352, 12_516_352),
    ] {
        let angle = Angle::from_udeg(udeg);
        assert_eq!(angle.normalised(Range::Bidirectional).udeg(), bidirectional, "{udeg}");
        assert_eq!(angle.normalised(Range::Unidirectional).udeg(), unidirectional, "{udeg}");
        assert_eq!(Range::Bidirectional.contains(angle), udeg == bidirectional);
        assert_eq!(Range::Unidirectional.contains(angle), udeg == unidirectional);
    }
    for range in [Range::Bidirectional, Range::Unidirectional] {
        assert!(range.contains(range.last()));
        assert!(!range.contains(Angle::from_udeg(range.last().udeg() + 1)));
    }
}

#[test]
fn differences_go_the_shorter_way() {
    let difference =
        |to: i32, from: i32| Angle::from_mdeg(to).unwrap().difference(Angle::from_mdeg(from).unwrap()).mdeg();
    assert_eq!(difference(10_000, 350_000), 20_000);
    assert_eq!(difference(350_000, 10_000), -20_000);
    assert_eq!(difference(-179_000, 179_000), 2_000);
    assert_eq!(difference(180_000, 0), -180_000);
    assert_eq!(difference(0, 180_000), -180_000);
    assert_eq!(difference(179_999, 0), 179_999);
    assert_eq!(difference(720_000, 0), 0);
    let far = Angle::from_udeg(i32::MAX).difference(Angle::from_udeg(i32::MIN));
    // 2^32 − 1 µ° in all: eleven turns and 334 967 295 µ°, that is 25 032 705 µ° short of twelve.
    assert_eq!(far.udeg(), -25_032_705);
}

#[test]
fn text_has_as_many_decimals_as_asked_for() {
    let angle = Angle::from_udeg(-45_313_499);
    assert_eq!(angle.to_string(), "-45.313");
    assert_eq!(format!("{angle:.0}"), "-45");
    assert_eq!(format!("{angle:.1}"), "-45.3");
    assert_eq!(format!("{angle:.4}"), "-45.3135");
    assert_eq!(format!("{angle:.6}"), "-45.313499");
    assert_eq!(format!("{angle:.9}"), "-45.313499");
    assert_eq!(Angle::ZERO.to_string(), "0.000");
    assert_eq!(format!("{:.0}", Angle::ZERO), "0");
    assert_eq!(Angle::from_udeg(7_000).to_string(), "0.007");
    assert_eq!(Angle::from_udeg(-499).to_string(), "0.000");
    assert_eq!(Angle::from_udeg(-500).to_string(), "-0.001");
    assert_eq!(Angle::from_udeg(999_500).to_string(), "1.000");
    assert_eq!(format!("{:.0}", Angle::from_udeg(9_500_000)), "10");
    assert_eq!(format!("{:.6}", Angle::from_udeg(i32::MIN)), "-2147.483648");
    assert_eq!(format!("{:.6}", Angle::from_udeg(i32::MAX)), "2147.483647");
}

#[test]
fn text_can_be_padded_like_a_number() {
    let angle = Angle::from_udeg(1_500_000);
    assert_eq!(format!("{angle:+}"), "+1.500");
    assert_eq!(format!("{angle:9}"), "    1.500");
    assert_eq!(format!("{angle:<9}|"), "1.500    |");
    assert_eq!(format!("{angle:09.1}"), "0000001.5");
    assert_eq!(format!("{:08.1}", Angle::from_udeg(-1_500_000)), "-00001.5");
}
