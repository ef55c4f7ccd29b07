//! T7s that noise has made deaf: they hear again after 500 ms without a request (T7 guide, section 1), however long the
//! others are asked. The gateway has heard little of that noise, or nothing.

use super::world::{Chance, Fate, Sensors, World, t7_slot};
use super::*;
use clino_bus::Duration;

const SECOND: u64 = 1_000_000;
const NODES: u8 = 8;
/// T7 guide, section 1.
const COMMAND_LASTS: u64 = 500_000;

/// Node 3 is made deaf at each of these times; node 5 may not be there.
struct Plant {
    chance: Chance,
    noise: &'static [u64],
    is_deaf: bool,
    /// Answers of node 1 that are spoilt: what the gateway hears of the noise.
    spoilt: &'static [u64],
    five_is_there: bool,
    /// The last request to any node.
    asked: u64,
    /// When the silences of 500 ms ended.
    silences: Vec<u64>,
    /// Answers of node 3.
    answered: Vec<u64>,
}

impl Plant {
    fn new(noise: &'static [u64], spoilt: &'static [u64]) -> Plant {
        Plant {
            chance: Chance::new(1),
            noise,
            is_deaf: false,
            spoilt,
            five_is_there: true,
            asked: 0,
            silences: Vec::new(),
            answered: Vec::new(),
        }
    }
}

/// Whether one of these times has come; it is taken away.
fn takes(times: &mut &'static [u64], now: u64) -> bool {
    match times.split_first() {
        Some((&at, rest)) if at <= now => {
            *times = rest;
            true
        }
        _ => false,
    }
}

impl Sensors for Plant {
    fn asked(&mut self, bus: Bus, _: &[u8], out: u64) {
        assert_eq!(bus, Bus::T7);
        if out - self.asked >= COMMAND_LASTS {
            self.silences.push(out);
            self.is_deaf = false;
        }
        self.is_deaf |= takes(&mut self.noise, out);
        self.asked = out;
    }
    fn fate(&mut self, _: Bus, node: u8, now: u64) -> Fate {
        match node {
            1 if takes(&mut self.spoilt, now) => Fate::Damaged,
            3 if self.is_deaf => Fate::Silent,
            5 if !self.five_is_there => Fate::Silent,
            3 => {
                self.answered.push(now);
                Fate::Well
            }
            _ => Fate::Well,
        }
    }
    fn t7(&self, _: u8, _: u64) -> i32 {
        45_000
    }
    fn isu(&self, _: u8, _: u64) -> u16 {
        0
    }
    fn chance(&mut self) -> &mut Chance {
        &mut self.chance
    }
}

fn world(plant: Plant) -> World<Plant> {
    let table: Vec<SlotConfig> = (1..=NODES).map(|node| t7_slot(node, Duration::ZERO)).collect();
    World::new(&table, plant)
}

/// The longest time without an answer of node 3.
fn longest_gap(world: &World<Plant>) -> u64 {
    world.sensors.answered.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap()
}

#[test]
fn on_a_noisy_line_a_deaf_node_is_back_within_seconds() {
    // Two errors, too far from each other and from the death to be its cause.
    let mut world = world(Plant::new(&[10 * SECOND], &[SECOND, 5 * SECOND]));
    world.skip(60 * SECOND);
    // A second until it is dead, five until the silence, half a second of that, and a probe.
    assert!(longest_gap(&world) < 8 * SECOND, "{}", longest_gap(&world));
    assert_eq!(world.status(2), Status::Ok);
    assert_eq!(world.sensors.silences.len(), 1, "{:?}", world.sensors.silences);
}

#[test]
fn noise_in_the_silence_itself_delays_it_by_the_next_pause() {
    // The first silence ends at about 16.6 s; what comes in it makes the node deaf again.
    let noise = &[10 * SECOND, 16 * SECOND + SECOND / 2, 17 * SECOND, 18 * SECOND];
    let mut world = world(Plant::new(noise, &[8 * SECOND, 9 * SECOND]));
    world.skip(90 * SECOND);
    assert!(longest_gap(&world) < 20 * SECOND, "{}", longest_gap(&world));
    assert_eq!(world.status(2), Status::Ok);
}

#[test]
fn a_node_that_alone_heard_noise_is_back_within_ten_minutes() {
    let mut world = world(Plant::new(&[10 * SECOND], &[]));
    world.skip(700 * SECOND);
    assert!(longest_gap(&world) < 604 * SECOND, "{}", longest_gap(&world));
    assert_eq!(world.status(2), Status::Ok);
}

#[test]
fn a_node_that_is_unplugged_leaves_the_others_alone() {
    for spoilt in [&[][..], &[10 * SECOND]] {
        let mut world = world(Plant::new(&[], spoilt));
        world.skip(10 * SECOND);
        world.sensors.five_is_there = false;
        world.skip(600 * SECOND);
        assert_eq!(world.sensors.silences.len(), 0, "{:?}", world.sensors.silences);
        world.skip(3_611 * SECOND);
        // Every ten minutes, 0.09 % of the bus.
        assert_eq!(world.sensors.silences.len(), 5, "{:?}", world.sensors.silences);
    }
}

#[test]
fn a_node_that_dies_on_a_noisy_line_and_stays_away_is_waited_for_ever_less() {
    let mut world = world(Plant::new(&[], &[4 * SECOND, 8 * SECOND]));
    world.skip(10 * SECOND);
    world.sensors.five_is_there = false;
    world.skip(3_600 * SECOND);
    let pauses: Vec<u64> =
        world.sensors.silences.windows(2).map(|pair| (pair[1] - pair[0]) / SECOND).collect();
    // 10, 20, 40 s and so on, the silence, and what a dead node may have to wait for its probe: two seconds.
    for (pause, doubled) in pauses.iter().zip([10, 20, 40, 80, 160, 320, 600, 600]) {
        assert!((doubled..=doubled + 3).contains(pause), "{pauses:?}");
    }
    assert!((9..=12).contains(&pauses.len()), "{pauses:?}");
}

#[test]
fn a_node_that_comes_and_goes_does_not_put_off_the_silence_for_another() {
    let mut world = world(Plant::new(&[10 * SECOND], &[8 * SECOND, 9 * SECOND]));
    for second in 10..60 {
        // Three seconds there, three away.
        world.sensors.five_is_there = second / 3 % 2 == 0;
        world.skip(second * SECOND);
    }
    assert!(longest_gap(&world) < 14 * SECOND, "{}", longest_gap(&world));
    assert_eq!(world.status(2), Status::Ok);
}
