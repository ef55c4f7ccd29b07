//! A setting of zero has one meaning, never stricter or wider than its neighbour's. A rate of zero is in
//! `slot/plausibility/tests.rs`, a reporting interval of zero in `crates/console`, `reporter/tests.rs`.

use super::world::{Chance, Fate, Sensors, World, isu_slot, t7_slot};
use super::*;
use crate::Health;
use crate::config::{Ask, Filter};
use clino_bus::Duration;
use clino_codec::angle::Angle;

const SECOND: u64 = 1_000_000;

/// Nodes with a given fault; the T7s turn slowly.
struct Fates {
    chance: Chance,
    /// The fault of every answer whose number is a multiple of the first.
    every: (u32, Fate),
    answers: u32,
}

impl Sensors for Fates {
    fn fate(&mut self, _: Bus, _: u8, _: u64) -> Fate {
        self.answers += 1;
        if self.answers.is_multiple_of(self.every.0) { self.every.1 } else { Fate::Well }
    }
    fn t7(&self, _: u8, now: u64) -> i32 {
        (now / 100_000) as i32
    }
    fn isu(&self, _: u8, _: u64) -> u16 {
        0x4000
    }
    fn chance(&mut self) -> &mut Chance {
        &mut self.chance
    }
}

fn world(table: &[SlotConfig], every: (u32, Fate)) -> World<Fates> {
    World::new(table, Fates { chance: Chance::new(1), every, answers: 0 })
}

/// Runs for two seconds; counts what was published of slot 0 as *ok*, and as anything else after the first *ok*.
fn published(world: &mut World<Fates>) -> (u32, u32) {
    let (mut ok, mut other) = (0, 0);
    world.run(2 * SECOND, |_, reading, now| {
        if reading.slot != 0 {
            return;
        }
        match reading.status(Instant::from_micros(now)) {
            Status::Ok => ok += 1,
            _ if ok > 0 => other += 1,
            _ => {}
        }
    });
    (ok, other)
}

/// As often as the bus can, and with the retries that are set: they were left to the next reading, which is due at
/// once.
#[test]
fn a_period_of_zero_is_as_often_as_possible_and_retries_as_any_other() {
    for period in [0, 20] {
        let config = SlotConfig { retries: 1, ..t7_slot(1, Duration::from_millis(period)) };
        let mut world = world(&[config], (10, Fate::Silent));
        let (ok, other) = published(&mut world);
        assert_eq!(other, 0, "period {period}: one lost answer in ten is made up for");
        let retries = world.gateway.slot_counters(0).unwrap().retries;
        assert!(retries > 5, "period {period}: {retries} retries");
        // 3 ms an exchange; after a lost answer the same is asked again when a late one cannot come any more,
        // after 25 ms.
        assert!(if period == 0 { ok > 250 } else { (80..=101).contains(&ok) }, "period {period}: {ok}");
    }
}

#[test]
fn retries_of_zero_are_none() {
    for period in [0, 20] {
        let config = SlotConfig { retries: 0, ..t7_slot(1, Duration::from_millis(period)) };
        let mut world = world(&[config], (10, Fate::Silent));
        let (_, other) = published(&mut world);
        assert!(other > 5, "period {period}: {other}");
        assert_eq!(world.gateway.slot_counters(0).unwrap().retries, 0);
    }
}

/// What the document says, not no time at all; and not for ever.
#[test]
fn a_timeout_of_zero_is_the_documents() {
    // The document's 2 ms, and up to 2 ms that a bus learns to add.
    for (timeout, late, answers) in [(0, 0, true), (0, 6_000, false), (10, 6_000, true)] {
        let timeout = Duration::from_millis(timeout);
        let config = SlotConfig { timeout, retries: 0, ..t7_slot(1, Duration::from_millis(50)) };
        let mut world = world(&[config], (1, Fate::Late(late)));
        let (ok, _) = published(&mut world);
        assert_eq!(ok > 30, answers, "{timeout:?}, {late} us late: {ok}");
    }
}

/// No deviation is tolerated: neither is the check switched off, nor does it complain of what fits exactly.
#[test]
fn a_tolerance_of_zero_tolerates_nothing() {
    for (tolerance, one_g) in [(0, true), (0, false), (100, true)] {
        let config = SlotConfig { ask: Ask::Everything, tolerance, ..t7_slot(1, T7_PERIOD) };
        let mut slot = crate::slot::Slot::new(config);
        // The world's T7 measures 1 g to the last step.
        let accelerations = [102_300 + i32::from(!one_g), 0, 0].map(clino_codec::t7::Acceleration);
        let fits = crate::slot::is_one_g(&accelerations, tolerance);
        assert_eq!(fits, one_g, "tolerance {tolerance}");
        for n in 0..5 {
            let sample = crate::slot::Sample { one_g: Some(fits), ..crate::slot::Sample::new(Angle::ZERO) };
            slot.settle(Ok(sample), Instant::from_micros(n * 20_000), true, 1);
        }
        assert_eq!(slot.reading(0).health.has(Health::GRAVITY), !one_g);
    }
    let pwm = |tolerance| SlotConfig {
        partner: Some(1),
        tolerance,
        ..SlotConfig::usual(Source::Pwm { input: PwmInput::Pwm1 })
    };
    for (tolerance, off_ticks, disagrees) in [(0, 0, false), (0, 100, true), (56, 100, false)] {
        let mut world = world(&[pwm(tolerance), isu_slot(1, ISU_PERIOD)], (1, Fate::Well));
        world.skip(SECOND);
        // 90° is (90 + 157.45) / 674.9 of the period: no whole number of ticks, so the partner says what the ticks do.
        let high = 1_026_600 + off_ticks;
        let cycle = Capture::Cycle(Ticks { period: 2_800_000, high });
        let exact = pwm::measure(
            Ticks { period: 2_800_000, high: 1_026_600 },
            &pwm::Limits::new(84_000_000),
            pwm::Law::Documented,
        );
        let off = exact.unwrap().angle.difference(Angle::from_turn16(0x4000)).udeg();
        for _ in 0..100 {
            let until = world.now + 33_333;
            world.skip(until);
            world.gateway.pwm(PwmInput::Pwm1, cycle, Instant::from_micros(world.now));
        }
        let seen = world.gateway.reading(0).unwrap().health.has(Health::DISAGREES);
        let expected = disagrees || tolerance == 0 && off != 0;
        assert_eq!(seen, expected, "tolerance {tolerance}, {off_ticks} ticks off, {off} µ°");
    }
}

/// A filter over one reading is none.
#[test]
fn a_filter_of_one_is_none() {
    let table = [Filter::Off, Filter::Mean, Filter::Median].map(|filter| SlotConfig {
        filter,
        samples: 1,
        ..t7_slot(1, Duration::from_millis(20))
    });
    let mut world = world(&table, (1, Fate::Well));
    world.run(SECOND, |sensors, reading, now| {
        if let Some(angle) = reading.angle(Instant::from_micros(now)) {
            let truth = sensors.t7(1, now);
            assert!((truth - angle.mdeg()).abs() <= 1, "slot {}: {} at {truth}", reading.slot, angle.mdeg());
        }
    });
    for filter in [Filter::Mean, Filter::Median] {
        let config = SlotConfig { filter, samples: 0, ..table[0] };
        assert!(crate::order::Order::Slot { slot: 0, config }.check().is_err(), "a filter over nothing");
    }
}
