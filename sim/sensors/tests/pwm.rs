//! The PWM output against the document's law, restated here in floating point.

mod common;

use clino_sim::motion::{DEGREE, Motion};
use clino_sim::pwm::{Cycle, Pwm, Quantisation, Stuck};
use common::{MS, SECOND};

fn ideal(angle: i64) -> Pwm {
    let mut pwm = Pwm::new(Motion::Constant(angle));
    pwm.quantisation = Quantisation::Ideal;
    pwm
}

fn pulse(pwm: &mut Pwm, at: u64) -> (f64, f64) {
    match pwm.next_cycle(at) {
        Cycle::Pulse { period, high } => (period as f64, high as f64),
        level @ Cycle::Level { .. } => panic!("no pulse but {level:?}"),
    }
}

/// Section 5: `Angle = 6.749 · duty[%] − 157.45`.
fn law((period, high): (f64, f64)) -> f64 {
    6.749 * (100.0 * high / period) - 157.45
}

#[test]
fn documented_example() {
    let (period, high) = pulse(&mut ideal(89_563_400), 0);
    assert!((high / period - 0.366).abs() < 1e-7, "{high} of {period}");
}

#[test]
fn documented_landmarks() {
    let (period, high) = pulse(&mut ideal(0), 0);
    assert!((high / period - 0.2333).abs() < 1e-4, "minimum duty at the null position");
    let (period, high) = pulse(&mut ideal(180 * DEGREE), 0);
    assert!((high / period - 0.5).abs() < 1e-7, "50 % at +180°");
}

#[test]
fn nominal_frequency_and_others() {
    for (millihertz, period) in [(30_000, 33_333_333.0), (29_400, 34_013_605.0), (30_600, 32_679_738.0)] {
        let mut pwm = ideal(0);
        pwm.frequency_millihertz = millihertz;
        assert_eq!(pulse(&mut pwm, 0).0, period);
    }
}

#[test]
fn ideal_edges_tell_the_angle_to_the_nanosecond() {
    for angle in (0..360_000_000).step_by(1_234_567) {
        let error = law(pulse(&mut ideal(angle), 0)) - angle as f64 / 1e6;
        // Half a nanosecond in 33 ms.
        assert!(error.abs() <= 674.9 * 0.5 / 33_333_333.0 + 1e-9, "{angle}: {error}");
    }
}

#[test]
fn steps_are_4_34_microseconds() {
    let mut widest: f64 = 0.0;
    for angle in (0..360_000_000).step_by(123_457) {
        let mut pwm = Pwm::new(Motion::Constant(angle));
        let (period, high) = pulse(&mut pwm, 0);
        let steps = high / 4_340.277_8;
        assert!((steps - steps.round()).abs() < 1e-3, "{high} ns are {steps} steps");
        widest = widest.max((law((period, high)) - angle as f64 / 1e6).abs());
    }
    // Half a step is 6.749 · 100 / 7680 / 2 degrees; some angle in the sweep comes close to it.
    assert!((0.0435..0.04394).contains(&widest), "{widest}");
}

#[test]
fn angle_is_taken_at_the_rising_edge_and_wraps() {
    let mut pwm = ideal(0);
    pwm.motion = Motion::Ramp { start: 0, rate: 100 * DEGREE };
    assert!((law(pulse(&mut pwm, 500 * MS)) - 50.0).abs() < 1e-4);
    assert!((law(pulse(&mut pwm, 4 * SECOND)) - 40.0).abs() < 1e-4);
    let said: Vec<_> = pwm.said().iter().map(|s| (s.at, s.sampled_at)).collect();
    assert_eq!(said, [(500 * MS, 500 * MS), (4 * SECOND, 4 * SECOND)]);
    assert!((pwm.said().last().unwrap().microdegrees - 40 * DEGREE).abs() <= 11);
}

#[test]
fn stuck_and_silent() {
    let mut pwm = ideal(0);
    pwm.stuck =
        vec![Stuck { from: 100, until: 200, high: false }, Stuck { from: 300, until: 1000, high: true }];
    assert!(matches!(pwm.next_cycle(99), Cycle::Pulse { .. }));
    assert_eq!(pwm.next_cycle(100), Cycle::Level { high: false, recheck_after: 100 });
    assert!(matches!(pwm.next_cycle(200), Cycle::Pulse { .. }));
    assert_eq!(pwm.next_cycle(999), Cycle::Level { high: true, recheck_after: 1 });
    pwm.frequency_millihertz = 0;
    assert!(matches!(pwm.next_cycle(0), Cycle::Level { high: false, recheck_after: 1.. }));
}
