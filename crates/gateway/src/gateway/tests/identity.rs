//! An axis that a T7 does not measure is a fault of the configuration, found before its first value.

use super::world::{Chance, Fate, Sensors, World, t7_slot};
use super::*;
use std::collections::BTreeSet;

/// Get Angle of axis 1, Get All Angles, Get Device Information (T7 guide sections 2.1 and 2.7.1).
const GET_ANGLE_1: u8 = 0x82;
const GET_DEVICE_INFORMATION: u8 = 0x8E;

/// One T7.
struct Node {
    product: [u8; 6],
    /// It does not answer.
    gone: bool,
    /// Commands that it was sent.
    commands: Vec<u8>,
    chance: Chance,
}

impl Sensors for Node {
    fn fate(&mut self, _: Bus, _: u8, _: u64) -> Fate {
        if self.gone { Fate::Silent } else { Fate::Well }
    }

    fn t7(&self, _: u8, _: u64) -> i32 {
        // What a single-axis device says of the others.
        if self.product == *b"T7-3  " { 33_333 } else { 0 }
    }

    fn product(&self, _: u8) -> [u8; 6] {
        self.product
    }

    fn asked(&mut self, _: Bus, frame: &[u8], _: u64) {
        self.commands.push(frame[2]);
    }

    fn isu(&self, _: u8, _: u64) -> u16 {
        0
    }

    fn chance(&mut self) -> &mut Chance {
        &mut self.chance
    }
}

fn world(product: &[u8; 6], axis: t7::Axis) -> World<Node> {
    let mut config = t7_slot(9, T7_PERIOD);
    config.source = Source::T7 { address: t7::Address::new(9).unwrap(), axis };
    let node = Node { product: *product, gone: false, commands: Vec::new(), chance: Chance::new(1) };
    World::new(&[config], node)
}

fn identity_requests(world: &World<Node>) -> usize {
    world.sensors.commands.iter().filter(|&&command| command == GET_DEVICE_INFORMATION).count()
}

#[test]
fn one_with_three_axes_is_asked_once_and_read() {
    let mut world = world(b"T7-3  ", t7::Axis::One);
    world.skip(1_000_000);
    assert_eq!(world.status(0), Status::Ok);
    assert_eq!(world.sensors.commands[0], GET_DEVICE_INFORMATION);
    assert_eq!(identity_requests(&world), 1);
    assert!(world.sensors.commands.contains(&GET_ANGLE_1));
    assert!(world.sensors.commands.len() > 45, "once a period: {}", world.sensors.commands.len());
}

#[test]
fn one_with_one_axis_is_a_fault_of_the_configuration_until_it_is_another() {
    for product in [b"T7-1  ", b"X4-1  ", b"T7-1\0\0"] {
        let mut world = world(product, t7::Axis::Zero);
        let mut seen = BTreeSet::new();
        world.run(2_000_000, |_, reading, now| {
            _ = seen.insert(reading.status(Instant::from_micros(now)).name())
        });
        assert_eq!(world.status(0), Status::ConfigFault);
        assert!(!seen.contains("ok"), "{seen:?}");
        assert_eq!(identity_requests(&world), world.sensors.commands.len(), "its angle is of no use");
        world.sensors.product = *b"T7-3  ";
        world.skip(2_200_000);
        assert_eq!(world.status(0), Status::Ok);
    }
}

/// The one that comes back may be another.
#[test]
fn one_that_was_away_is_asked_again() {
    let mut world = world(b"T7-3  ", t7::Axis::One);
    world.skip(500_000);
    assert_eq!((world.status(0), identity_requests(&world)), (Status::Ok, 1));
    world.sensors.gone = true;
    world.skip(4_000_000);
    (world.sensors.gone, world.sensors.product) = (false, *b"T7-1  ");
    let mut seen = BTreeSet::new();
    world.run(8_000_000, |_, reading, now| _ = seen.insert(reading.status(Instant::from_micros(now)).name()));
    assert_eq!(world.status(0), Status::ConfigFault);
    assert!(!seen.contains("ok"), "{seen:?}");
}

#[test]
fn the_axis_that_all_have_is_not_asked_about() {
    let mut world = world(b"T7-1  ", t7::Axis::Two);
    world.skip(500_000);
    assert_eq!((world.status(0), identity_requests(&world)), (Status::Ok, 0));
}

/// At the address of all, no single T7 can be asked for its identity.
#[test]
fn another_axis_at_the_address_of_all_is_not_read() {
    let source = Source::T7 { address: t7::Address::of_request(126).unwrap(), axis: t7::Axis::One };
    let mut world = World::new(
        &[SlotConfig::usual(source)],
        Node { product: *b"T7-3  ", gone: false, commands: Vec::new(), chance: Chance::new(1) },
    );
    world.skip(500_000);
    assert_eq!(world.status(0), Status::ConfigFault);
    assert!(world.sensors.commands.is_empty());
}
