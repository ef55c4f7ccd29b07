//! Every value that a sensor can send, through a slot: the published angle is in its range, and nearest to the true
//! one.
//!
//! | | daily | `cargo xtask campaign publication` |
//! |---|---|---|
//! | ISU | all 65 536 codes, with soft zeros that bring them to a seam | with soft zeros from 0.001° to 359.999°, 0.037° apart |
//! | PWM | all ticks of the legal window at the nominal period, 100 apart | each, at the shortest, the nominal and the longest period |
//! | T7 | every 0.001° of both its ranges, 0.007° apart | each |
//!
//! each in both ranges and both directions. A soft zero is a whole number of millidegrees, or what a sensor said; so
//! what is left to round depends on the code alone, and the seams are where an angle may leave its range: 0.037° has no
//! factor in common with a turn, so that both sides of every seam are met.
//!
//! The expected angles are computed and rounded in 64 bits, in billionths of a degree.

use clino_codec::pwm::{Law, Limits, Ticks, measure};
use clino_codec::t7::Direction;

use super::*;
use crate::config::Filter;
use crate::slot::{Sample, Slot};
use crate::{PwmInput, SlotConfig, Source, Status};
use clino_bus::Instant;

/// Nano-degrees in a turn, and in a millidegree.
const TURN_NDEG: i64 = 360_000_000_000;
const NDEG_PER_MDEG: i64 = 1_000_000;
const RANGES: [Range; 2] = [Range::Unidirectional, Range::Bidirectional];
const DIRECTIONS: [Direction; 2] = [Direction::Normal, Direction::Reversed];

/// A slot that publishes every value at once, without confirmation.
fn slot(range: Range, direction: Direction, soft_zero: Angle) -> Slot {
    let usual = SlotConfig::usual(Source::Pwm { input: PwmInput::Pwm1 });
    Slot::new(SlotConfig { range, direction, soft_zero, confirm: false, ..usual })
}

/// What the slot publishes of an angle, in 0.001°.
fn published(slot: &mut Slot, raw: Angle) -> i32 {
    assert!(slot.settle(Ok(Sample::new(raw)), Instant::from_micros(1), true, 0));
    slot.digest();
    let reading = slot.reading(0);
    assert_eq!(reading.status(Instant::from_micros(1)), Status::Ok);
    reading.angle(Instant::from_micros(1)).expect("it is ok").mdeg()
}

/// Checks what is published of `raw`, in 0.001°, which is truly `truth` nano-degrees; a µ° of either is what it may be
/// off for the µ° in which angles are kept.
#[track_caller]
fn check(mdeg: i32, truth: i64, range: Range) {
    let allowed = if range == Range::Unidirectional { 0..=359_999 } else { -180_000..=179_999 };
    assert!(allowed.contains(&mdeg), "{truth} n° is published as {mdeg} m°");
    let off = (i64::from(mdeg) * NDEG_PER_MDEG - truth).rem_euclid(TURN_NDEG);
    assert!(off.min(TURN_NDEG - off) <= 501_000, "{truth} n° is published as {mdeg} m°");
}

fn ndeg(angle: Angle) -> i64 {
    i64::from(angle.udeg()) * 1_000
}

/// In both ranges and both directions, from each of these soft zeros.
fn check_all(raw: Angle, truth: i64, zeros: impl Iterator<Item = Angle> + Clone) {
    for zero in zeros {
        for range in RANGES {
            for direction in DIRECTIONS {
                let from_zero = truth - ndeg(zero);
                let counted = if direction == Direction::Reversed { -from_zero } else { from_zero };
                check(published(&mut slot(range, direction, zero), raw), counted, range);
            }
        }
    }
}

/// Soft zeros that bring an angle to either seam, from both sides, and the angle itself, as `zero` takes it.
fn seams(raw: Angle) -> impl Iterator<Item = Angle> + Clone {
    let whole = [-1, 0, 1, 179_999, 180_000, 180_001].map(|off| Angle::from_mdeg(raw.mdeg() + off).unwrap());
    whole.into_iter().chain([raw])
}

/// Every soft zero of a turn, `step` apart.
fn zeros(step: usize) -> impl Iterator<Item = Angle> + Clone {
    (1..360_000).step_by(step).map(|mdeg| Angle::from_mdeg(mdeg).unwrap())
}

/// The angle of a code: code · 360/65536°, exactly.
fn isu(code: u16) -> i64 {
    i64::from(code) * TURN_NDEG / 65_536
}

/// Whether all of it is run: the campaign sets this.
fn is_campaign() -> bool {
    std::env::var_os("CLINO_EVERY_ANGLE").is_some()
}

#[test]
fn every_isu_code_at_every_seam() {
    for code in 0..=u16::MAX {
        let raw = Angle::from_turn16(code);
        check_all(raw, isu(code), seams(raw));
        check(Published::of_sensor(raw).mdeg(), isu(code), Range::Unidirectional);
        if is_campaign() {
            check_all(raw, isu(code), zeros(37));
        }
    }
}

/// All duties that are legal at a period, `step` ticks apart; returns how many there are.
fn pwm(period: u32, step: usize) -> u32 {
    let limits = Limits::new(84_000_000);
    let mut legal = 0;
    for high in (0..=period).step_by(step) {
        let Ok(reading) = measure(Ticks { period, high }, &limits, Law::Documented) else { continue };
        legal += 1;
        // 6.749 times the duty in per cent, less 157.45 (AN #201 section 5), kept within the turn.
        let law = (674_900_000_000 * i64::from(high) / i64::from(period) - 157_450_000_000)
            .clamp(0, TURN_NDEG - 1_000);
        let raw = reading.angle;
        let zeros = [Angle::ZERO, raw, Angle::from_mdeg(raw.mdeg()).unwrap()];
        check_all(raw, law, zeros.into_iter());
        check(Published::of_sensor(raw).mdeg(), law, Range::Unidirectional);
    }
    legal
}

/// 84 MHz for 1/30 s.
const NOMINAL: u32 = 2_800_000;

#[test]
fn the_legal_window_of_the_pwm_output() {
    if is_campaign() {
        for period in [2_660_000, NOMINAL, 2_940_000] {
            assert!(pwm(period, 1) > 1_000_000);
        }
    }
    let legal = pwm(NOMINAL, 100);
    // 23.33 to 76.67 % with 0.05 % of slack at either end.
    assert!((14_955..=14_970).contains(&legal), "{legal}");
    // Where the law leaves the turn at either end: every tick.
    for high in (651_000..654_000).chain(2_146_000..2_149_000) {
        if let Ok(reading) =
            measure(Ticks { period: NOMINAL, high }, &Limits::new(84_000_000), Law::Documented)
        {
            check_all(reading.angle, ndeg(reading.angle), seams(reading.angle));
        }
    }
}

#[test]
fn the_whole_range_of_a_t7() {
    let step = if is_campaign() { 1 } else { 7 };
    for mdeg in (-180_000..360_000).step_by(step) {
        let raw = Angle::from_mdeg(mdeg).unwrap();
        // A zero as it was typed, and one that another sensor has left there: no whole millidegree.
        let odd = Angle::from_udeg(12_345_678);
        check_all(raw, ndeg(raw), seams(raw).chain([Angle::ZERO, odd]));
        assert_eq!(Published::of_sensor(raw).mdeg(), mdeg, "it is said as the sensor counts");
    }
}

/// Angles that tremble about every seam of either range, through both filters of every length: nothing is published on
/// the other side of the turn.
#[test]
fn filters_across_the_seam() {
    for seam in [0, 90_000_000, 180_000_000, 270_000_000] {
        for samples in 1..=Filter::MOST {
            for filter in [Filter::Mean, Filter::Median] {
                for (range, direction) in RANGES.into_iter().flat_map(|range| DIRECTIONS.map(|d| (range, d)))
                {
                    // The seam, brought to 0° or 180° of the slot, and the code nearest to it.
                    for zero in [seam, seam + 180_000_000].map(Angle::from_udeg) {
                        let mut slot = slot(range, direction, zero);
                        slot.config.filter = filter;
                        slot.config.samples = samples;
                        for n in 0..200_i32 {
                            // ±0.008° about the seam, in steps of 0.0007°; every code of an ISU there is met.
                            let off = (n * 7_919 % 23 - 11) * 733;
                            let raw = Angle::from_udeg((seam + off).rem_euclid(360_000_000));
                            let mdeg = published(&mut slot, raw);
                            let truth = i64::from(seam) * 1_000 - ndeg(zero);
                            let apart = (i64::from(mdeg) * NDEG_PER_MDEG - truth).rem_euclid(TURN_NDEG);
                            assert!(apart.min(TURN_NDEG - apart) <= 9_000_000, "{filter:?} {range:?} {mdeg}");
                            let allowed =
                                if range == Range::Unidirectional { 0..=359_999 } else { -180_000..=179_999 };
                            assert!(allowed.contains(&mdeg), "{filter:?} {range:?} {mdeg}");
                        }
                        assert!(slot.reading(0).turns().abs() <= 1, "it trembles, it does not turn");
                    }
                }
            }
        }
    }
}
