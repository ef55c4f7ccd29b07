//! A bus on which no node answers for a while: which slots are asked meanwhile, and how soon all are read again.

use super::world::{Chance, Fate, Sensors, World, isu_slot, t7_slot};
use super::*;
use crate::BusFault;
use clino_bus::Duration;

const SECOND: u64 = 1_000_000;
const T7S: u8 = 20;
const ISUS: u8 = 4;
/// Request, 2 ms, first character and its margin, quiet and guard: what a T7 costs that does not answer.
const T7_IN_VAIN: u64 = 2_610;

/// Nodes of which none answers between these times, and some never answer.
struct Plant {
    chance: Chance,
    bus: Bus,
    from: u64,
    until: u64,
    dead: fn(u8) -> bool,
    /// First good answer of each node after the fault.
    back: [Option<u64>; 33],
}

impl Plant {
    fn new(bus: Bus, from: u64, until: u64, dead: fn(u8) -> bool) -> Plant {
        Plant { chance: Chance::new(1), bus, from, until, dead, back: [None; 33] }
    }
}

impl Sensors for Plant {
    fn fate(&mut self, bus: Bus, node: u8, now: u64) -> Fate {
        let out_of_order = bus == self.bus && (self.from..self.until).contains(&now);
        if out_of_order || bus == self.bus && (self.dead)(node) {
            return Fate::Silent;
        }
        if bus == self.bus && now >= self.until {
            self.back[usize::from(node)].get_or_insert(now);
        }
        Fate::Well
    }
    fn t7(&self, _: u8, _: u64) -> i32 {
        45_000
    }
    fn isu(&self, _: u8, _: u64) -> u16 {
        1_000
    }
    fn chance(&mut self) -> &mut Chance {
        &mut self.chance
    }
}

fn world(plant: Plant) -> World<Plant> {
    let mut table: Vec<SlotConfig> =
        (1..=T7S).map(|node| t7_slot(node, Duration::from_millis(100))).collect();
    table.extend((1..=ISUS).map(|node| isu_slot(node, Duration::from_millis(266))));
    World::new(&table, plant)
}

/// When the last of these nodes was back, µs after the end of the fault.
fn back(world: &World<Plant>, nodes: impl Iterator<Item = u8>) -> u64 {
    let until = world.sensors.until;
    let latest =
        nodes.map(|node| world.sensors.back[usize::from(node)].expect("it comes back") - until).max();
    latest.expect("nodes")
}

#[test]
fn a_mute_bus_is_faulty_after_half_a_second_and_the_other_is_not() {
    let mut world = world(Plant::new(Bus::T7, 2 * SECOND, 60 * SECOND, |_| false));
    world.skip(2 * SECOND + 490_000);
    assert_eq!(world.gateway.health(Bus::T7).fault, None);
    // Half a second and a cycle.
    world.skip(2 * SECOND + 620_000);
    assert_eq!(world.gateway.health(Bus::T7).fault, Some(BusFault::Mute));
    world.skip(30 * SECOND);
    assert_eq!(world.gateway.health(Bus::T7).fault, Some(BusFault::Mute));
    assert_eq!(world.gateway.health(Bus::T7).faults, 1);
    assert_eq!(world.gateway.health(Bus::Isu), crate::BusHealth::default());
    assert!((0..usize::from(T7S)).all(|slot| world.status(slot) == Status::NoAnswer));
}

#[test]
fn all_nodes_of_a_mute_t7_bus_are_read_again_within_one_cycle() {
    for until in [3_000_000, 7_003_333, 30_055_555, 61_098_765] {
        let mut world = world(Plant::new(Bus::T7, 2 * SECOND, until, |_| false));
        world.skip(until + 2 * SECOND);
        let latest = back(&world, 1..=T7S);
        std::println!("fault until {until} us: the last of {T7S} was asked {latest} us later");
        // The period, which is longer than all of them in vain, and the exchange that was under way.
        assert!(latest <= 100_000 + T7_IN_VAIN, "{latest}");
        assert_eq!(world.gateway.health(Bus::T7).fault, None);
    }
}

#[test]
fn all_nodes_of_a_mute_isu_bus_are_read_again_within_one_cycle() {
    for until in [5_000_000, 9_003_333, 31_055_555, 61_298_765] {
        let mut world = world(Plant::new(Bus::Isu, 2 * SECOND, until, |_| false));
        world.skip(until);
        assert_eq!(world.gateway.health(Bus::Isu).fault, Some(BusFault::Mute));
        world.skip(until + 2 * SECOND);
        let latest = back(&world, 1..=ISUS);
        std::println!("fault until {until} us: the last of {ISUS} was asked {latest} us later");
        // The same module is not asked again before a late answer is out of the question: 53 ms and 400 ms.
        assert!(latest <= 53_084 + 400_000 + 4 * 60_000, "{latest}");
    }
}

#[test]
fn those_that_were_dead_before_do_not_hold_up_the_others() {
    let odd: fn(u8) -> bool = |node| node % 2 == 1;
    let mut world = world(Plant::new(Bus::T7, 5 * SECOND, 9 * SECOND, odd));
    world.skip(5 * SECOND);
    assert_eq!(world.gateway.health(Bus::T7).fault, None);
    world.skip(9 * SECOND);
    assert_eq!(world.gateway.health(Bus::T7).fault, Some(BusFault::Mute));
    world.skip(11 * SECOND);
    assert!(back(&world, (1..=T7S).filter(|&node| !odd(node))) <= 100_000 + T7_IN_VAIN);
    assert_eq!(world.gateway.health(Bus::T7).fault, None);
}

#[test]
fn one_dead_node_is_no_fault_of_its_bus() {
    let mut world = world(Plant::new(Bus::T7, 0, 0, |node| node == 7));
    for at in 1..20 {
        world.skip(at * SECOND);
        assert_eq!(world.gateway.health(Bus::T7).fault, None);
    }
    assert_eq!(world.gateway.health(Bus::T7).faults, 0);
}

#[test]
fn a_bus_without_slots_is_not_faulty() {
    let mut world = world(Plant::new(Bus::T7, 0, 60 * SECOND, |_| false));
    world.skip(3 * SECOND);
    assert_eq!(world.gateway.health(Bus::T7).fault, Some(BusFault::Mute));
    for slot in 0..T7S {
        let order = crate::order::Order::Slot { slot, config: SlotConfig::OFF };
        world.gateway.carry_out(order, crate::Requester::Console).expect("a slot takes anything");
    }
    assert_eq!(world.gateway.health(Bus::T7).fault, None);
}
