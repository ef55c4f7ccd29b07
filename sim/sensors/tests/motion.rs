//! Motions against hand-computed angles.

mod common;

use clino_sim::motion::{DEGREE, Motion, bidirectional, unidirectional};
use common::{MS, SECOND};

#[test]
fn constant() {
    let motion = Motion::Constant(-5);
    assert_eq!([motion.at(0), motion.at(u64::MAX)], [-5, -5]);
}

#[test]
fn ramp_is_unwrapped_and_exact() {
    let motion = Motion::Ramp { start: 10 * DEGREE, rate: -90 * DEGREE };
    assert_eq!(motion.at(500 * MS), -35 * DEGREE);
    assert_eq!(motion.at(8 * SECOND), -710 * DEGREE);
    let slow = Motion::Ramp { start: 0, rate: 1 };
    assert_eq!(slow.at(3 * SECOND - 1), 2);
}

#[test]
fn ramp_saturates() {
    assert_eq!(Motion::Ramp { start: 0, rate: i64::MAX }.at(u64::MAX), i64::MAX);
}

#[test]
fn sine_at_its_landmarks() {
    let motion = Motion::Sine { centre: 5 * DEGREE, amplitude: 10 * DEGREE, period: 1200 * MS, phase: 0 };
    let degrees = [0, 100, 300, 600, 900, 1200, 1300].map(|ms| motion.at(ms * MS));
    assert_eq!(degrees, [5, 10, 15, 5, -5, 5, 10].map(|d| d * DEGREE));
}

#[test]
fn sine_phase_and_zero_period() {
    let motion = Motion::Sine { centre: 0, amplitude: DEGREE, period: 0, phase: 90 * DEGREE };
    assert_eq!([motion.at(0), motion.at(7 * SECOND)], [DEGREE, DEGREE]);
}

#[test]
fn table_holds_its_ends_and_steps() {
    let motion = Motion::Table(vec![(10, 100), (20, 200), (20, 500), (30, 400)]);
    assert_eq!(
        [0, 10, 15, 19, 20, 25, 30, 99].map(|t| motion.at(t)),
        [100, 100, 150, 190, 500, 450, 400, 400]
    );
    assert_eq!(Motion::Table(Vec::new()).at(5), 0);
}

#[test]
fn normalisers_at_the_seams() {
    let turn = 360_000_000;
    assert_eq!([-1, 0, turn - 1, turn, -turn].map(unidirectional), [turn - 1, 0, turn - 1, 0, 0]);
    let half = 180_000_000;
    assert_eq!(
        [half - 1, half, -half, -half - 1, turn + 7].map(bidirectional),
        [half - 1, -half, -half, half - 1, 7]
    );
}
