//! Alarms of a whole gateway: what sensors do over time, what is published, what orders change.

use super::world::{Chance, Fate, Sensors, World, t7_slot};
use super::*;
use crate::alarm::{Alarm, AlarmState};
use crate::config::{AlarmConfig, AlarmLimits};

/// A T7 that stands at 5°, at 15° from 2 s to 4 s, and is silent from 6 s to 9 s.
struct Bridge(Chance);

impl Sensors for Bridge {
    fn fate(&mut self, _: Bus, _: u8, now: u64) -> Fate {
        if (6_000_000..9_000_000).contains(&now) { Fate::Silent } else { Fate::Well }
    }
    fn t7(&self, _: u8, now: u64) -> i32 {
        if (2_000_000..4_000_000).contains(&now) { 15_000 } else { 5_000 }
    }
    fn isu(&self, _: u8, _: u64) -> u16 {
        0
    }
    fn chance(&mut self) -> &mut Chance {
        &mut self.0
    }
}

const WATCHED: AlarmConfig = AlarmConfig {
    high: 10_000,
    low: -10_000,
    hysteresis: 1_000,
    delay: 5,
    no_value: 10,
    limits: AlarmLimits::Both,
    ..AlarmConfig::OFF
};

fn world(alarm: AlarmConfig) -> World<Bridge> {
    World::new(&[SlotConfig { alarm, ..t7_slot(1, T7_PERIOD) }], Bridge(Chance::new(1)))
}

/// The states of *high* and *no_value* as they are published, and when they change, in tenths of a second.
fn changes(alarm: AlarmConfig, until: u64) -> Vec<(u64, AlarmState, AlarmState)> {
    let mut changes = Vec::new();
    let mut before = (AlarmState::Quiet, AlarmState::Quiet);
    world(alarm).run(until, |_, reading, now| {
        let states = (reading.alarms.state(Alarm::High), reading.alarms.state(Alarm::NoValue));
        if core::mem::replace(&mut before, states) != states {
            changes.push((now / 100_000, states.0, states.1));
        }
    });
    changes
}

#[test]
fn they_come_after_their_delay_and_go_with_their_cause() {
    use AlarmState::{Active, Quiet};
    // The jump to 15° is confirmed within 0.1 s, and half a second later it is an alarm. One second after the last value
    // there is none; the node is found again within two seconds.
    let found = changes(WATCHED, 12_000_000);
    let [raised, ended, silent, back] = found[..] else { panic!("{found:?}") };
    assert!((25..=27).contains(&raised.0) && (raised.1, raised.2) == (Active, Quiet), "{found:?}");
    assert!((40..=41).contains(&ended.0) && (ended.1, ended.2) == (Quiet, Quiet), "{found:?}");
    assert!((70..=71).contains(&silent.0) && (silent.1, silent.2) == (Quiet, Active), "{found:?}");
    assert!((90..=110).contains(&back.0) && (back.1, back.2) == (Quiet, Quiet), "{found:?}");
}

#[test]
fn what_latches_is_published_until_it_is_acknowledged() {
    use AlarmState::{Acknowledged, Active, Quiet, Unacknowledged};
    let mut world = world(AlarmConfig { latching: true, ..WATCHED });
    let state = |world: &mut World<Bridge>, alarm| world.gateway.reading(0).unwrap().alarms.state(alarm);
    world.skip(3_000_000);
    assert_eq!(state(&mut world, Alarm::High), Active);
    world.gateway.carry_out(Order::Acknowledge(Some(1)), Requester::Modbus).unwrap();
    assert_eq!(state(&mut world, Alarm::High), Active, "that was another slot's");
    world.gateway.carry_out(Order::Acknowledge(None), Requester::Console).unwrap();
    assert_eq!(state(&mut world, Alarm::High), Acknowledged);
    assert_eq!(world.gateway.next_changed().map(|reading| reading.slot), Some(0), "it is published");
    world.skip(5_000_000);
    assert_eq!(state(&mut world, Alarm::High), Quiet);
    world.skip(11_500_000);
    assert_eq!(state(&mut world, Alarm::NoValue), Unacknowledged);
    let detail = world.gateway.alarm(0, Alarm::NoValue, Instant::from_micros(world.now)).unwrap();
    assert!((4_400..=4_600).contains(&detail.age_ms), "{detail:?}");
    assert_eq!(world.gateway.carry_out(Order::Acknowledge(Some(0)), Requester::Modbus), Ok(()));
    assert!(world.gateway.reading(0).unwrap().alarms.is_quiet());
    assert!(world.gateway.carry_out(Order::Acknowledge(Some(48)), Requester::Console).is_err());
}

#[test]
fn other_settings_of_the_slot_do_not_end_what_latches_and_another_sensor_does() {
    let mut world = world(AlarmConfig { latching: true, ..WATCHED });
    world.skip(3_000_000);
    let config = *world.gateway.config(0).unwrap();
    let retries = SlotConfig { retries: 5, ..config };
    world.gateway.carry_out(Order::Slot { slot: 0, config: retries }, Requester::Console).unwrap();
    assert_eq!(world.gateway.reading(0).unwrap().alarms.state(Alarm::High), AlarmState::Active);
    // Another limit ends it, and what latches waits; if the angle is beyond the new one, it is active again at once.
    let lower = SlotConfig { alarm: AlarmConfig { high: 9_000, ..config.alarm }, ..config };
    world.gateway.carry_out(Order::Slot { slot: 0, config: lower }, Requester::Console).unwrap();
    assert_eq!(world.gateway.reading(0).unwrap().alarms.state(Alarm::High), AlarmState::Unacknowledged);
    world.skip(3_500_000);
    assert_eq!(world.gateway.reading(0).unwrap().alarms.state(Alarm::High), AlarmState::Active);
    for other in [
        SlotConfig { source: t7_slot(2, T7_PERIOD).source, ..config },
        SlotConfig { enabled: false, ..config },
    ] {
        world.gateway.carry_out(Order::Slot { slot: 0, config: other }, Requester::Console).unwrap();
        assert!(world.gateway.reading(0).unwrap().alarms.is_quiet());
    }
}

#[test]
fn a_slot_that_never_had_a_value_raises_no_value_too() {
    // The slot is set while its node is silent.
    let alarm = AlarmConfig { no_value: 20, ..AlarmConfig::OFF };
    let mut world = world(alarm);
    world.gateway.carry_out(Order::Slot { slot: 0, config: SlotConfig::OFF }, Requester::Console).unwrap();
    world.skip(6_100_000);
    let slot = SlotConfig { alarm, ..t7_slot(7, T7_PERIOD) };
    world.gateway.carry_out(Order::Slot { slot: 0, config: slot }, Requester::Console).unwrap();
    let mut raised = None;
    world.run(8_900_000, |_, reading, now| {
        if reading.alarms.state(Alarm::NoValue) == AlarmState::Active {
            raised.get_or_insert(now);
        }
    });
    assert!(raised.is_some_and(|at| (8_100_000..=8_400_000).contains(&at)), "{raised:?}");
}

#[test]
fn extremes_are_those_of_the_published_angle_and_are_forgotten_by_order() {
    let mut world = world(AlarmConfig::OFF);
    world.skip(5_000_000);
    let now = Instant::from_micros(world.now);
    let angles = |world: &World<Bridge>| {
        let extremes = world.gateway.detail(0).unwrap().extremes;
        (extremes.lowest(now).map(|low| low.mdeg), extremes.highest(now).map(|high| high.mdeg))
    };
    assert_eq!(angles(&world), (Some(5_000), Some(15_000)));
    let highest = world.gateway.detail(0).unwrap().extremes.highest(now).unwrap();
    assert!((900..=1_100).contains(&highest.age_ms), "{highest:?}");
    // A name changes nothing; a zero does.
    let config = *world.gateway.config(0).unwrap();
    let named = SlotConfig { name: crate::config::Name::new("pier").unwrap(), ..config };
    world.gateway.carry_out(Order::Slot { slot: 0, config: named }, Requester::Console).unwrap();
    assert_eq!(angles(&world), (Some(5_000), Some(15_000)));
    world.gateway.carry_out(Order::ClearExtremes(None), Requester::Console).unwrap();
    assert_eq!(angles(&world), (None, None));
    world.skip(5_500_000);
    assert_eq!(angles(&world), (Some(5_000), Some(5_000)));
    let zeroed = SlotConfig { soft_zero: clino_codec::angle::Angle::from_udeg(1_000_000), ..config };
    world.gateway.carry_out(Order::Slot { slot: 0, config: zeroed }, Requester::Console).unwrap();
    assert_eq!(angles(&world), (None, None));
}
