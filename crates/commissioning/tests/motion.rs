//! A sensor that moves is not set to zero: nothing is written, and the rate is reported.

mod common;

use std::sync::{Arc, Mutex};

use clino_bus::{Duration, Isu, T7};
use clino_codec::t7::{Axis, Millidegrees};
use clino_commissioning::isu::{self, ResetNull};
use clino_commissioning::t7::{Cause, SetZero, Zeroed};
use clino_sim::isu::ChecksumScope;
use clino_sim::motion::Motion;
use clino_sim::t7::{Damping, Options, OutputRange, StoredSettings};
use clino_testkit::rig::Bench;
use common::isu::{eeprom, module, with, words};
use common::t7::{Shared, device};
use common::{MS, SECOND, run};
use proptest::prelude::*;

const MDEG: i64 = 1_000;

fn t7(motion: Motion, range: OutputRange, damping: Damping, damping_ms: u16) -> Shared {
    let store = StoredSettings { address: 5, damping_ms, range, ..StoredSettings::default() };
    let options =
        Options { motion: [Motion::Constant(0), Motion::Constant(0), motion], damping, ..Options::default() };
    Arc::new(Mutex::new(clino_sim::t7::T7::new(Default::default(), store, options).unwrap()))
}

fn zero(sensor: &Shared) -> Result<Zeroed, clino_commissioning::t7::Failure> {
    let mut bench: Bench<T7> = common::t7::bench(&[sensor]);
    run(&mut bench, SetZero::new(device(5), Axis::Two)).result
}

fn ramp(mdeg_per_s: i64) -> Motion {
    Motion::Ramp { start: 30_000_000, rate: mdeg_per_s * MDEG }
}

#[test]
fn a_t7_that_turns_is_refused_with_its_rate_and_nothing_is_written() {
    for mdeg_per_s in [500, 1_000, 20_000, 300_000, 1_000_000] {
        for rate in [mdeg_per_s, -mdeg_per_s] {
            for range in [OutputRange::Bidirectional, OutputRange::Unidirectional] {
                for (damping, ms) in [(Damping::Ignored, 20), (Damping::Averaged, 500)] {
                    // Averaging across the seam is the simulator's own affair.
                    if damping == Damping::Averaged && mdeg_per_s > 20_000 {
                        continue;
                    }
                    let sensor = t7(ramp(rate), range, damping, ms);
                    let failure = zero(&sensor).unwrap_err();
                    let Cause::Moving { mdeg_per_s: seen } = failure.cause else { panic!("{failure}") };
                    let off = i64::from(seen) * 100 / mdeg_per_s - 100;
                    assert!(off.abs() <= 2, "{seen} instead of {rate}");
                    assert_eq!((failure.writes, sensor.lock().unwrap().writes()), (0, 0));
                }
            }
        }
    }
}

/// What the tolerance of the read-back allows is not refused.
#[test]
fn a_t7_that_creeps_is_zeroed_with_one_write() {
    for rate in [0, 100, -100, 350, -350] {
        let sensor = t7(ramp(rate), OutputRange::Bidirectional, Damping::Ignored, 20);
        let zeroed = zero(&sensor).unwrap();
        assert!(zeroed.after.0.abs() <= 100, "{zeroed:?}");
        assert_eq!((zeroed.writes, sensor.lock().unwrap().writes()), (1, 1), "{rate}");
    }
}

#[test]
fn a_t7_that_has_come_to_rest_is_zeroed() {
    // It turns for a second, then stands.
    let points = vec![(0, 0), (SECOND, 20_000_000)];
    let sensor = t7(Motion::Table(points), OutputRange::Bidirectional, Damping::Averaged, 800);
    let mut bench: Bench<T7> = common::t7::bench(&[&sensor]);
    common::idle_for(&mut bench, Duration::from_micros(1_500_000));
    // The average has not settled yet when it is asked, and has when it is read.
    let zeroed = run(&mut bench, SetZero::new(device(5), Axis::Two)).result.unwrap();
    assert_eq!((zeroed.before, zeroed.after, zeroed.writes), (Millidegrees(20_000), Millidegrees(0), 1));
}

/// Passing through zero is not standing there.
#[test]
fn a_t7_that_passes_zero_is_refused() {
    // 0 at 39 ms, about when it is read the first time.
    for start in (-900_000..-300_000).step_by(20_000) {
        let motion = Motion::Ramp { start, rate: 20_000_000 };
        let sensor = t7(motion, OutputRange::Bidirectional, Damping::Ignored, 20);
        let failure = zero(&sensor).unwrap_err();
        assert!(matches!(failure.cause, Cause::Moving { .. }), "{failure}");
        assert_eq!(sensor.lock().unwrap().writes(), 0);
    }
}

proptest! {
    /// Vibration within the sensor's bandwidth of 8 Hz, at any phase: where it is 0.5° wide, nothing is written; where it
    /// is slower than what is watched, it may stand still for that long, but it is not written again and again.
    #[test]
    fn a_t7_that_vibrates(
        width in 500..20_000_i64, period_ms in 125..5_000_u64, phase_mdeg in 0..360_000_i64,
    ) {
        let motion = Motion::Sine {
            centre: 12_000_000,
            amplitude: width * MDEG / 2,
            period: period_ms * MS,
            phase: phase_mdeg * MDEG,
        };
        let sensor = t7(motion, OutputRange::Bidirectional, Damping::Ignored, 20);
        let result = zero(&sensor);
        let writes = sensor.lock().unwrap().writes();
        match result {
            Ok(zeroed) => prop_assert_eq!(u64::from(zeroed.writes), writes),
            Err(failure) => {
                prop_assert!(matches!(failure.cause, Cause::Moving { .. } | Cause::NotZero { .. }), "{}", failure);
                prop_assert_eq!(u64::from(failure.writes), writes);
            }
        }
        prop_assert!(writes <= 1, "{} writes", writes);
        if period_ms <= 400 {
            prop_assert_eq!(writes, 0);
        }
    }
}

fn null(motion: Motion, phase: u64) -> (common::isu::Shared, Result<isu::Nulled, isu::Failure>) {
    let options = clino_sim::isu::Options { motion, phase, ..common::isu::options() };
    let sensor = with(3, ChecksumScope::default(), options);
    let mut bench: Bench<Isu> = common::isu::bench(&[&sensor]);
    let result = run(&mut bench, ResetNull::new(module(3))).result;
    (sensor, result)
}

#[test]
fn an_isu_that_turns_is_refused_with_its_rate_and_nothing_is_written() {
    for mdeg_per_s in [200, 1_000, 20_000, 200_000] {
        for rate in [mdeg_per_s, -mdeg_per_s] {
            for phase in (0..533).step_by(41) {
                let (sensor, result) = null(ramp(rate), phase * MS);
                let failure = result.unwrap_err();
                let isu::Cause::Moving { mdeg_per_s: seen } = failure.cause else { panic!("{failure}") };
                // Its own resolution is 5.5 mdeg.
                let off = i64::from(seen) - mdeg_per_s;
                assert!(off.abs() <= 12 + mdeg_per_s / 50, "{seen} instead of {rate} at phase {phase}");
                assert_eq!((failure.writes, failure.repair), (0, false));
                assert_eq!(eeprom(&sensor).null(), 0);
            }
        }
    }
}

#[test]
fn an_isu_that_creeps_is_zeroed_with_one_write() {
    for rate in [0, 30, -30, 80, -80] {
        for phase in (0..533).step_by(100) {
            let (_, result) = null(ramp(rate), phase * MS);
            let nulled = result.unwrap();
            assert!(nulled.after.min(nulled.after.wrapping_neg()) <= 18, "{nulled:?}");
            assert_eq!(nulled.writes, 1, "{rate} at phase {phase}");
        }
    }
}

/// The module corrects its checksum by the difference: one that is wrong stays wrong.
#[test]
fn an_isu_whose_checksum_is_wrong_is_not_zeroed() {
    let sensor = common::isu::at(3);
    let word = words(&sensor)[0x10] ^ 1;
    sensor.lock().unwrap().eeprom.set_word(0x10, word);
    let before = words(&sensor);
    let mut bench: Bench<Isu> = common::isu::bench(&[&sensor]);
    let failure = run(&mut bench, ResetNull::new(module(3))).result.unwrap_err();
    assert!(matches!(failure.cause, isu::Cause::Unsound(_)), "{failure}");
    assert_eq!((failure.writes, words(&sensor)), (0, before));
}
