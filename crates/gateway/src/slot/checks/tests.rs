//! Signals and when they are raised.

use super::*;
use crate::Health;
use std::vec::Vec;

fn accelerations(g: [f64; 3]) -> [Acceleration; 3] {
    g.map(|g| Acceleration((g * 102_300.0).round() as i32))
}

#[test]
fn a_device_at_rest_measures_one_g_however_it_lies() {
    for step in 0..360 {
        let (sin, cos) = f64::from(step).to_radians().sin_cos();
        assert!(is_one_g(&accelerations([sin, cos, 0.0]), 1));
        assert!(is_one_g(&accelerations([0.6 * sin, 0.6 * cos, -0.8]), 1));
        assert!(!is_one_g(&accelerations([1.02 * sin, 1.02 * cos, 0.0]), 10));
        assert!(!is_one_g(&accelerations([0.98 * sin, 0.0, 0.98 * cos]), 10));
    }
    assert!(!is_one_g(&accelerations([0.0; 3]), 100));
    assert!(!is_one_g(&[Acceleration(i32::MIN); 3], 100));
}

#[test]
fn the_guides_own_example_passes_the_usual_tolerance() {
    // T7 guide section 2.3: 0000025C, 00000428, FFFE8225.
    let example = [0x25C, 0x428, 0xFFFE_8225_u32 as i32].map(Acceleration);
    assert!(is_one_g(&example, 100));
    assert!(!is_one_g(&example, 40), "0.956 g is more than 0.04 g off");
}

#[test]
fn a_check_speaks_after_enough_failures_in_a_row() {
    let mut strikes = Strikes::default();
    let spoken: Vec<bool> =
        [false, false, true, false, false, false, true].map(|fits| strikes.count(fits, 3)).to_vec();
    assert_eq!(spoken, [false, false, false, false, false, true, false]);
}

#[test]
fn a_line_is_noisy_when_more_than_one_request_in_200_fails() {
    let mut link = Link::default();
    // One in a window of 200 is not too many.
    assert!((0..200).all(|n| link.count(n == 7) == (n == 199).then_some(false)));
    // The second one is.
    assert_eq!(link.count(true), None);
    assert_eq!(link.count(true), Some(true));
    // It stays so to the end of the window, and is well after a clean one.
    assert!((2..200).all(|_| link.count(false) == Some(true)));
    assert!((0..200).all(|n| link.count(false) == (n == 199).then_some(false)));
}

#[test]
fn signals_have_names_and_survive_as_bits() {
    let mut health = Health::WELL;
    health.set(Health::GRAVITY, true);
    health.set(Health::NOISY, true);
    health.set(Health::GRAVITY, false);
    assert!(health.names().eq(["noisy"]));
    assert_eq!(Health::from_bits(health.bits()), health);
    assert_eq!(Health::from_bits(0xFF).names().count(), 3);
}
