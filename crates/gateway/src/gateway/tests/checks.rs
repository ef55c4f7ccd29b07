//! The cross-checks and the PWM inputs, as a gateway makes them.

use super::world::{Chance, Fate, Sensors, World, isu_slot, t7_slot};
use super::*;
use crate::Health;
use crate::config::Ask;
use clino_bus::Duration;

/// One ISU at 90° or where `isu` puts it, and T7s that measure 1 g.
struct Still {
    isu: u16,
    chance: Chance,
}

impl Sensors for Still {
    fn fate(&mut self, _: Bus, _: u8, _: u64) -> Fate {
        Fate::Well
    }
    fn t7(&self, _: u8, _: u64) -> i32 {
        45_000
    }
    fn isu(&self, _: u8, _: u64) -> u16 {
        self.isu
    }
    fn chance(&mut self) -> &mut Chance {
        &mut self.chance
    }
}

fn pwm_slot(partner: Option<u8>) -> SlotConfig {
    SlotConfig { partner, ..SlotConfig::usual(Source::Pwm { input: PwmInput::Pwm1 }) }
}

/// A cycle of 1/30 s at 84 MHz for an angle in degrees: 6.749 times the duty in per cent, less 157.45
/// (AN #201 section 5).
fn cycle(degrees: f64) -> Capture {
    let high = ((degrees + 157.45) / 674.9 * 2_800_000.0).round() as u32;
    Capture::Cycle(Ticks { period: 2_800_000, high })
}

fn world(table: &[SlotConfig]) -> World<Still> {
    World::new(table, Still { isu: 0x4000, chance: Chance::new(1) })
}

/// Feeds `count` cycles; returns after how many the signal was first seen.
fn cycles(world: &mut World<Still>, degrees: f64, count: u32) -> Option<u32> {
    (1..=count).find(|_| {
        let until = world.now + 33_333;
        world.skip(until);
        world.gateway.pwm(PwmInput::Pwm1, cycle(degrees), Instant::from_micros(world.now));
        world.gateway.reading(0).unwrap().health.has(Health::DISAGREES)
    })
}

#[test]
fn a_pwm_output_that_says_something_else_than_its_serial_line_is_seen() {
    let mut world = world(&[pwm_slot(Some(1)), isu_slot(1, ISU_PERIOD)]);
    world.skip(1_000_000);
    assert_eq!(cycles(&mut world, 90.5, 200), None, "0.5° is within its tolerance of 0.56°");
    let seen = cycles(&mut world, 90.6, 200).expect("0.6° is not");
    // 48 cycles in a row, and one in which it moves.
    assert!((48..=50).contains(&seen), "{seen}");
    assert_eq!(world.status(0), Status::Ok, "it is a signal beside the value");
    assert_eq!(cycles(&mut world, 90.0, 1), None, "one that fits ends it");
    // Across the seam.
    world.sensors.isu = 0xFFFF;
    let until = world.now + 3_000_000;
    world.skip(until);
    assert_eq!(cycles(&mut world, 0.3, 100), None);
}

#[test]
fn without_a_partner_that_reads_nothing_is_compared() {
    for partner in [None, Some(1), Some(47), Some(200)] {
        let mut world = world(&[pwm_slot(partner), SlotConfig::OFF]);
        assert_eq!(cycles(&mut world, 12.0, 100), None);
    }
}

#[test]
fn a_t7_that_does_not_measure_one_g_is_seen() {
    let everything = |tolerance| SlotConfig { ask: Ask::Everything, tolerance, ..t7_slot(1, T7_PERIOD) };
    let mut well = world(&[everything(1)]);
    well.skip(1_000_000);
    assert_eq!(well.gateway.reading(0).unwrap().health, Health::WELL);
    assert!(well.gateway.slots[0].slot.sound(Instant::from_micros(well.now)).is_some());
    // The same device, if 1 g were something else.
    let mut slot = crate::slot::Slot::new(everything(1));
    let sample = crate::slot::Sample { one_g: Some(false), ..crate::slot::Sample::new(Default::default()) };
    for n in 0..4 {
        slot.settle(Ok(sample), Instant::from_micros(n * 20_000), true, 1);
    }
    assert!(slot.reading(0).health.has(Health::GRAVITY), "the first is held back, three are seen");
}

#[test]
fn edges_without_a_whole_cycle_are_no_signal() {
    let mut world = world(&[pwm_slot(None)]);
    let lost = |world: &mut World<Still>| {
        let now = world.now;
        world.gateway.pwm(PwmInput::Pwm1, Capture::LostEdge, Instant::from_micros(now));
        world.status(0)
    };
    assert_eq!(lost(&mut world), Status::NoSignal, "there never was a cycle");
    cycles(&mut world, 10.0, 1);
    assert_eq!(lost(&mut world), Status::Ok, "one lost edge is no fault");
    let until = world.now + 100_001;
    world.skip(until);
    assert_eq!(lost(&mut world), Status::NoSignal);
}

#[test]
fn a_pwm_input_is_confirmed_if_so_configured() {
    let confirmed = SlotConfig { confirm: true, max_rate: 100_000, ..pwm_slot(None) };
    let mut world = world(&[confirmed]);
    for (degrees, status) in [
        (10.0, Status::NeverRead),
        (10.1, Status::Ok),
        // 3.3° a cycle, and two steps.
        (13.5, Status::Ok),
        // A jump: what was there stays until another cycle agrees.
        (200.0, Status::Ok),
        (201.0, Status::Ok),
    ] {
        cycles(&mut world, degrees, 1);
        assert_eq!(world.status(0), status, "{degrees}");
    }
    let said = |world: &mut World<Still>| {
        world.gateway.reading(0).unwrap().raw(Instant::from_micros(world.now)).unwrap()
    };
    assert!((said(&mut world).udeg() - 201_000_000).abs() < 10_000);
    cycles(&mut world, 20.0, 1);
    assert!((said(&mut world).udeg() - 201_000_000).abs() < 10_000, "held back");
    cycles(&mut world, 90.0, 1);
    assert_eq!(world.status(0), Status::Suspect);
}

#[test]
fn a_slot_that_is_set_during_an_exchange_does_not_get_its_answer() {
    let mut world = world(&[t7_slot(1, Duration::ZERO)]);
    world.skip(1_000_000);
    // To and fro between two sensors, so that what was counted begins anew.
    for (wait, address) in (0..4_000).step_by(37).zip([2, 1].into_iter().cycle()) {
        let until = world.now + 10_000 + wait;
        world.skip(until);
        let config = t7_slot(address, Duration::ZERO);
        world
            .gateway
            .carry_out(crate::order::Order::Slot { slot: 0, config }, crate::Requester::Console)
            .unwrap();
        assert_eq!(world.status(0), Status::NeverRead);
        assert_eq!(world.gateway.slot_counters(0).unwrap().requests, 0);
        // An exchange takes 3 ms: whatever ends before that is of the slot as it was.
        let until = world.now + 2_900;
        world.skip(until);
        assert_eq!(world.gateway.slot_counters(0).unwrap().first_try, 0);
    }
}
