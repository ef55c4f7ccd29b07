//! What a T7 makes of its motion ("T7 Communication User Guide" 1.7, sections 1, 2.2 to 2.6).

mod common;

use clino_sim::motion::Motion;
use clino_sim::t7::{Damping, Direction, Model, Options, OutputRange, StoredSettings, T7};
use common::t7::{bench, make, settings, status, turned};
use common::{Bench, MS, SECOND, hex};

#[test]
fn reported_is_directed_plus_offset_in_range() {
    use Direction::{Normal, Reversed};
    use OutputRange::{Bidirectional, Unidirectional};
    for (micro, direction, offset, range, expected) in [
        (170_000_000, Normal, 20_000, Bidirectional, -170_000),
        (170_000_000, Normal, 20_000, Unidirectional, 190_000),
        (170_000_000, Reversed, 0, Bidirectional, -170_000),
        (170_000_000, Reversed, 20_000, Unidirectional, 210_000),
        (180_000_000, Normal, 0, Bidirectional, -180_000),
        (179_999_499, Normal, 0, Bidirectional, 179_999),
        (359_999_500, Normal, 0, Unidirectional, 0),
        (-1_000, Normal, 0, Unidirectional, 359_999),
        (725_000_000, Normal, -5_000, Bidirectional, 0),
    ] {
        let settings =
            StoredSettings { directions: [direction; 3], offsets: [offset; 3], range, ..settings() };
        let options = Options { motion: [(); 3].map(|()| Motion::Constant(micro)), ..Options::default() };
        let mut bench = make(Model::T73, settings, options);
        let answer = hex(&bench.ask("05 01 82"));
        let told = i32::from_be_bytes(answer[3..7].try_into().unwrap());
        assert_eq!(told, expected, "{micro} {direction:?} {offset} {range:?}");
        assert_eq!(bench.node.said().last().unwrap().microdegrees, i64::from(expected) * 1000);
    }
}

#[test]
fn offsets_follow_the_output_range() {
    let mut bench = bench();
    assert_eq!(status(&mut bench, "05 07 86 02 FF FF FF FF"), 0);
    assert!(bench.ask("05 01 85").ends_with("FF FF FF FF 6C"));
    assert_eq!(status(&mut bench, "05 03 8D 01"), 0);
    assert!(bench.ask("05 01 85").contains("00 05 7E 3F"), "−0.001° is 359.999°");
}

#[test]
fn accelerations_are_one_g_and_lead_back_to_the_angle() {
    let told = |bench: &mut Bench<T7>| {
        let answer = hex(&bench.ask("05 01 87"));
        [17, 21, 25]
            .map(|at| f64::from(i32::from_be_bytes(answer[at..at + 4].try_into().unwrap())) / 102_300.0)
    };
    for degrees in (-180..180).step_by(7) {
        let [x, y, z] = told(&mut turned(Model::T71, [0, 0, degrees * 1_000_000]));
        assert!((x.hypot(y) - 1.0).abs() < 2e-5 && z == 0.0);
        let off = x.atan2(y).to_degrees() - degrees as f64;
        assert!(off.abs() < 0.001 || (off - 360.0).abs() < 0.001, "{degrees}: off by {off}");

        let (roll, pitch) = (degrees, degrees / 3);
        let [x, y, z] = told(&mut turned(Model::T73, [roll * 1_000_000, pitch * 1_000_000, 5]));
        assert!(((x * x + y * y + z * z).sqrt() - 1.0).abs() < 2e-5);
        assert!(((-x).asin().to_degrees() - pitch as f64).abs() < 0.01);
        let off = y.atan2(z).to_degrees() - roll as f64;
        assert!(off.abs() < 0.01 || (off - 360.0).abs() < 0.01, "{roll}: off by {off}");
    }
}

#[test]
fn averaging_settles_one_damping_time_after_a_step() {
    let step = Motion::Table(vec![(2 * SECOND, 0), (2 * SECOND, 90_000_000)]);
    let options = Options {
        motion: [Motion::default(), Motion::default(), step],
        damping: Damping::Averaged,
        ..Options::default()
    };
    let bench = make(Model::T71, StoredSettings { damping_ms: 1000, ..settings() }, options);
    let at = |ms: u64| bench.node.angle_at(2, ms * MS);
    assert_eq!([at(1999), at(3001)], [0, 90_000]);
    assert!((30_000..60_000).contains(&at(2500)), "{}", at(2500));
}
