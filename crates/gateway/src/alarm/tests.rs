//! When alarms are raised, when they end, and what they tell. Times and angles are made up here; a whole gateway is in
//! `gateway/tests/alarms.rs`.

use super::*;
use crate::config::AlarmLimits;
use proptest::prelude::*;
use std::vec::Vec;

/// A value every 20 ms.
const STEP: u64 = 20_000;
const STEP_MS: u64 = STEP / 1_000;

/// Both limits at ±10°, 1° of hysteresis.
const BOTH: AlarmConfig = AlarmConfig {
    high: 10_000,
    low: -10_000,
    hysteresis: 1_000,
    limits: AlarmLimits::Both,
    ..AlarmConfig::OFF
};

struct Bench {
    watch: Watch,
    config: AlarmConfig,
    now: u64,
}

impl Bench {
    fn new(config: AlarmConfig) -> Bench {
        Bench { watch: Watch::default(), config, now: 5_000_000 }
    }

    /// Takes an angle and returns the state of an alarm.
    fn angle(&mut self, angle: i32, alarm: Alarm) -> AlarmState {
        self.take(angle, 0);
        self.watch.alarms().state(alarm)
    }

    fn take(&mut self, angle: i32, rate: i32) {
        self.now += STEP;
        self.watch.take(&self.config, angle, rate, Instant::from_micros(self.now), false);
    }

    fn detail(&self, alarm: Alarm) -> Option<(u64, Option<i32>)> {
        self.watch.detail(alarm, Instant::from_micros(self.now)).map(|detail| (detail.age_ms, detail.extreme))
    }
}

#[test]
fn a_limit_is_passed_and_the_alarm_ends_behind_the_hysteresis() {
    let mut bench = Bench::new(BOTH);
    let states = [9_999, 10_000, 10_001, 12_000, 9_001, 9_000, 10_000, 10_001]
        .map(|angle| bench.angle(angle, Alarm::High));
    use AlarmState::{Active, Quiet};
    assert_eq!(states, [Quiet, Quiet, Active, Active, Active, Quiet, Quiet, Active]);
    let mut bench = Bench::new(BOTH);
    let states =
        [-10_000, -10_001, -12_000, -9_001, -9_000, -10_000].map(|angle| bench.angle(angle, Alarm::Low));
    assert_eq!(states, [Quiet, Active, Active, Active, Quiet, Quiet]);
}

#[test]
fn only_the_limits_that_count_raise() {
    for (limits, high, low) in [
        (AlarmLimits::Off, false, false),
        (AlarmLimits::High, true, false),
        (AlarmLimits::Low, false, true),
        (AlarmLimits::Both, true, true),
    ] {
        let raised = |angle, alarm| {
            let mut bench = Bench::new(AlarmConfig { limits, ..BOTH });
            bench.angle(angle, alarm) == AlarmState::Active
        };
        assert_eq!((raised(20_000, Alarm::High), raised(-20_000, Alarm::Low)), (high, low), "{limits:?}");
    }
}

#[test]
fn a_condition_has_to_hold_for_the_whole_delay() {
    // 0.1 s are five steps after the first.
    let mut bench = Bench::new(AlarmConfig { delay: 1, ..BOTH });
    let states: Vec<AlarmState> = (0..6).map(|_| bench.angle(11_000, Alarm::High)).collect();
    assert_eq!(states.iter().filter(|state| **state == AlarmState::Active).count(), 1, "{states:?}");
    assert_eq!(bench.detail(Alarm::High), Some((0, Some(11_000))), "the time of the alarm, not of its cause");
    // One value within the limit begins it anew.
    let mut bench = Bench::new(AlarmConfig { delay: 1, ..BOTH });
    for angle in [11_000, 11_000, 11_000, 11_000, 10_000, 11_000, 11_000, 11_000, 11_000, 11_000] {
        assert_eq!(bench.angle(angle, Alarm::High), AlarmState::Quiet);
    }
    assert_eq!(bench.angle(11_000, Alarm::High), AlarmState::Active);
    // So does a gap.
    let mut bench = Bench::new(AlarmConfig { delay: 1, ..BOTH });
    bench.take(11_000, 0);
    bench.now += 200_000;
    bench.watch.take(&bench.config, 11_000, 0, Instant::from_micros(bench.now), true);
    assert!(bench.watch.alarms().is_quiet());
}

#[test]
fn first_time_and_extreme_are_kept() {
    let mut bench = Bench::new(BOTH);
    for angle in [11_000, 15_000, 12_000] {
        bench.take(angle, 0);
    }
    assert_eq!(bench.detail(Alarm::High), Some((2 * STEP_MS, Some(15_000))));
    bench.take(0, 0);
    assert_eq!(bench.detail(Alarm::High), None);
    for angle in [-11_000, -12_000, -11_500] {
        bench.take(angle, 0);
    }
    assert_eq!(bench.detail(Alarm::Low), Some((2 * STEP_MS, Some(-12_000))));
}

#[test]
fn one_that_latches_waits_for_its_acknowledgement() {
    use AlarmState::{Acknowledged, Active, Quiet, Unacknowledged};
    let mut bench = Bench::new(AlarmConfig { latching: true, delay: 1, ..BOTH });
    for _ in 0..6 {
        bench.take(11_000, 0);
    }
    assert_eq!(bench.angle(0, Alarm::High), Unacknowledged);
    // Again, at once, with its first time; the extreme goes on.
    assert_eq!(bench.angle(13_000, Alarm::High), Active);
    assert_eq!(bench.detail(Alarm::High), Some((2 * STEP_MS, Some(13_000))));
    assert!(bench.watch.acknowledge() && !bench.watch.acknowledge());
    assert_eq!(bench.angle(13_000, Alarm::High), Acknowledged);
    assert_eq!(bench.angle(0, Alarm::High), Quiet);
    // One that has ended is quiet when it is acknowledged.
    for _ in 0..6 {
        bench.take(11_000, 0);
    }
    assert_eq!(bench.angle(0, Alarm::High), Unacknowledged);
    assert!(bench.watch.acknowledge());
    assert_eq!(bench.angle(0, Alarm::High), Quiet);
    // The next one is a new one, with its delay.
    assert_eq!(bench.angle(11_000, Alarm::High), Quiet);
}

#[test]
fn a_rate_counts_either_way() {
    let mut bench = Bench::new(AlarmConfig { rate: 5_000, ..AlarmConfig::OFF });
    for (rate, active) in [(5_000, false), (5_001, true), (-5_001, true), (-5_000, false), (-9_000, true)] {
        bench.take(0, rate);
        assert_eq!(bench.watch.alarms().state(Alarm::Rate) == AlarmState::Active, active, "{rate}");
    }
    assert_eq!(bench.detail(Alarm::Rate), Some((0, Some(-9_000))));
}

#[test]
fn no_value_is_an_alarm_after_its_time_with_or_without_a_last_one() {
    for measured in [Some(Instant::from_micros(1_000_000)), None] {
        let config = AlarmConfig { no_value: 20, ..AlarmConfig::OFF };
        let mut watch = Watch::default();
        let raised =
            (10..=40).find(|tenth| watch.miss(&config, measured, Instant::from_micros(tenth * 100_000)));
        // Two seconds after the last one, or after the first look.
        assert_eq!(raised, Some(31), "{measured:?}");
        assert_eq!(watch.alarms().state(Alarm::NoValue), AlarmState::Active);
        assert_eq!(watch.detail(Alarm::NoValue, Instant::from_micros(4_000_000)).unwrap().extreme, None);
        watch.take(&config, 0, 0, Instant::from_micros(4_100_000), true);
        assert!(watch.alarms().is_quiet());
    }
}

#[test]
fn other_alarms_stay_as_they_are_without_a_value() {
    let mut bench = Bench::new(AlarmConfig { no_value: 1, ..BOTH });
    bench.take(11_000, 0);
    let (last, later) = (Instant::from_micros(bench.now), Instant::from_micros(bench.now + 10_000_000));
    assert!(bench.watch.miss(&bench.config, Some(last), later));
    assert_eq!(bench.watch.alarms().bits(), 0b1001_1001, "high and no_value, both unacknowledged");
}

#[test]
fn other_numbers_end_what_they_raised() {
    let mut bench = Bench::new(AlarmConfig { no_value: 1, ..BOTH });
    bench.take(11_000, 0);
    bench.watch.restart(&bench.config);
    assert!(bench.watch.alarms().is_quiet());
    let mut bench = Bench::new(AlarmConfig { latching: true, ..BOTH });
    bench.take(11_000, 0);
    bench.watch.restart(&bench.config);
    assert_eq!(bench.watch.alarms().state(Alarm::High), AlarmState::Unacknowledged);
}

/// A change of one thing that is watched ends that, and nothing else.
#[test]
fn what_is_watched_as_before_stays_as_it_is() {
    let all = AlarmConfig { rate: 5_000, no_value: 10, ..BOTH };
    let raised = || {
        let mut bench = Bench::new(all);
        bench.take(11_000, 9_000);
        assert!(bench.watch.miss(&all, Some(Instant::from_micros(0)), Instant::from_micros(20_000_000)));
        bench
    };
    let quiet = |to: AlarmConfig| {
        let mut bench = raised();
        bench.watch.change(&all, &to);
        let is_quiet = |alarm: &Alarm| bench.watch.alarms().state(*alarm) == AlarmState::Quiet;
        [Alarm::High, Alarm::Rate, Alarm::NoValue].into_iter().filter(is_quiet).collect::<Vec<_>>()
    };
    assert_eq!(quiet(AlarmConfig { hysteresis: 2_000, delay: 9, latching: true, low: -1, ..all }), []);
    assert_eq!(quiet(AlarmConfig { high: 10_001, ..all }), [Alarm::High]);
    assert_eq!(quiet(AlarmConfig { limits: AlarmLimits::Low, ..all }), [Alarm::High]);
    assert_eq!(quiet(AlarmConfig { rate: 0, ..all }), [Alarm::Rate]);
    assert_eq!(quiet(AlarmConfig { no_value: 11, ..all }), [Alarm::NoValue]);
}

proptest! {
    /// Against a model that keeps the whole history: an alarm is active exactly while its condition has held for the delay
    /// and has not ended.
    #[test]
    fn the_state_is_what_the_history_says(
        angles in prop::collection::vec(-15_i32..=15, 1..60),
        delay in 0_u16..4,
        hysteresis in 0_u32..6,
    ) {
        let config = AlarmConfig { high: 10, low: -10, hysteresis, delay, limits: AlarmLimits::Both, ..AlarmConfig::OFF };
        let mut bench = Bench::new(config);
        let (mut active, mut holds_since): (bool, Option<usize>) = (false, None);
        for (index, &angle) in angles.iter().enumerate() {
            bench.now += 100_000 - STEP;
            bench.take(angle, 0);
            if active {
                active = i64::from(angle) > 10 - i64::from(hysteresis);
                holds_since = None;
            } else if angle > 10 {
                let since = *holds_since.get_or_insert(index);
                active = index - since >= usize::from(delay);
            } else {
                holds_since = None;
            }
            prop_assert_eq!(bench.watch.alarms().state(Alarm::High) == AlarmState::Active, active, "{}", index);
        }
    }

    /// Any bits are a state, and a change is found.
    #[test]
    fn bits_are_states(one in any::<u8>(), other in any::<u8>()) {
        let (from, to) = (Alarms::from_bits(one), Alarms::from_bits(other));
        let mut shown = from;
        for _ in 0..ALARMS {
            if let Some(alarm) = shown.first_change(to) {
                shown = shown.with(alarm, to);
            }
        }
        prop_assert_eq!(shown, to);
    }
}
