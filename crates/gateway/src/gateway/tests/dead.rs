//! One node among dead ones, on a bus that is never idle and on one that is.
//!
//! The wire is played by arithmetic: a frame goes out after the guard, at 86.8 µs a character, and a living node's
//! answer begins 2 ms after it, as late as its document allows.

use super::*;
use clino_bus::Duration;

const NODES: u8 = 32;
const CHARACTER_NS: u64 = 86_806;
const LATENCY: u64 = 2_000;
const GUARD: u64 = 87;

fn micros(characters: u64) -> u64 {
    (characters * CHARACTER_NS).div_ceil(1_000)
}

struct World {
    gateway: Gateway,
    alive: fn(u8, u64) -> bool,
    now: u64,
    /// The line is silent from then on.
    silent: u64,
    /// What is still to happen, in order.
    events: std::collections::VecDeque<(u64, Event)>,
    /// Requests sent to each node.
    asked: [u32; NODES as usize + 1],
}

impl World {
    fn new(period: Duration, alive: fn(u8, u64) -> bool) -> World {
        let table: Vec<SlotConfig> = (1..=NODES)
            .map(|address| {
                let address = t7::Address::new(address).unwrap();
                slot(Source::T7 { address, axis: t7::Axis::Two }, period)
            })
            .collect();
        let timing = Timing::t7(Serial::T7_DEFAULT);
        let gateway =
            Gateway::new(&Settings::new(&table, timing, Timing::isu()), pwm::Limits::new(84_000_000));
        World {
            gateway,
            alive,
            now: 0,
            silent: 0,
            events: Default::default(),
            asked: [0; NODES as usize + 1],
        }
    }

    fn run(&mut self, until: u64) {
        while self.now < until {
            let mut sent = None;
            self.gateway.poll(Bus::T7, Instant::from_micros(self.now), |action| {
                if let Action::Send(frame) = action {
                    sent = Some(frame.to_vec());
                }
            });
            if let Some(frame) = sent {
                self.send(&frame);
            }
            let event_at = self.events.front().map(|&(at, _)| at);
            let poll_at = self.gateway.poll_at(Bus::T7).map(|at| at.as_micros().max(self.now));
            let next = [event_at, poll_at].into_iter().flatten().min().unwrap();
            self.now = next;
            if event_at == Some(next) {
                let (_, event) = self.events.pop_front().unwrap();
                self.gateway.line(Bus::T7, event);
            }
        }
    }

    fn send(&mut self, frame: &[u8]) {
        let address = frame[0];
        let all = frame[1..] == [0x01, 0x80];
        assert!(all || frame[1..] == [0x01, 0x83]);
        self.asked[usize::from(address)] += 1;
        let out = self.now.max(self.silent + GUARD) + micros(3);
        self.events.push_back((out, Event::Released { at: Instant::from_micros(out) }));
        self.silent = out;
        if (self.alive)(address, out) {
            let mut answer = match all {
                true => [&[address, 0x10, 0x80][..], &[0; 14]].concat(),
                false => [&[address, 0x06, 0x83][..], &[0; 4]].concat(),
            };
            answer.push(answer.iter().fold(0, |sum: u8, byte| sum.wrapping_sub(*byte)));
            let length = answer.len() as u64;
            for (index, byte) in (1..).zip(answer) {
                let at = Instant::from_micros(out + LATENCY + micros(index) - 5);
                self.events
                    .push_back((at.as_micros(), Event::Heard { character: Character::clean(byte), at }));
            }
            self.silent = out + LATENCY + micros(length);
        }
    }

    /// Good answers of a second, once the gateway has found the dead nodes.
    fn rate(period: Duration, alive: fn(u8, u64) -> bool) -> u32 {
        let mut world = World::new(period, alive);
        world.run(3_000_000);
        let before = world.gateway.counters(Bus::T7).good;
        world.run(13_000_000);
        (world.gateway.counters(Bus::T7).good - before) / 10
    }
}

/// Only node 7 is there.
fn seven(address: u8, _: u64) -> bool {
    address == 7
}

#[test]
fn one_living_node_of_32_keeps_nine_tenths_of_its_rate() {
    for period in [Duration::ZERO, T7_PERIOD] {
        // Solo: only its own slot in the table.
        let mut solo = World::new(period, seven);
        for index in (0..NODES).filter(|&index| index != 6) {
            let (slot, config) = (index, SlotConfig::OFF);
            solo.gateway
                .carry_out(crate::order::Order::Slot { slot, config }, crate::Requester::Console)
                .expect("a slot takes anything");
        }
        solo.run(10_000_000);
        let solo_rate = solo.gateway.counters(Bus::T7).good / 10;
        let rate = World::rate(period, seven);
        std::println!("period {} us: {rate}/s among 31 dead nodes, {solo_rate}/s alone", period.as_micros());
        assert!(rate * 10 >= solo_rate * 9, "{rate} of {solo_rate}");
    }
}

#[test]
fn living_nodes_do_not_pay_for_an_unused_budget() {
    // 3 + 8 characters, 2 ms and the guard: 3.042 ms.
    let rate = World::rate(Duration::ZERO, |_, _| true);
    assert!(rate >= 328, "{rate}");
}

#[test]
fn dead_nodes_take_turns() {
    // Their periods pass many times between two probes: none may be forgotten over the others. On a busy bus, the turns
    // come from the budget: 31 probes of 2.5 ms and a twenty-first of the bus, 1.65 s; else from the longest
    // pause, 1.2 s.
    for (period, turns) in [(Duration::ZERO, 7..=9), (Duration::from_millis(20), 10..=12)] {
        let mut world = World::new(period, seven);
        world.run(60_000_000);
        let asked = world.asked;
        world.run(60_000_000 + 13_000_000);
        for address in (1..=NODES).filter(|&address| address != 7) {
            let probes = world.asked[usize::from(address)] - asked[usize::from(address)];
            assert!(turns.contains(&probes), "{address}: {probes}");
        }
    }
}

#[test]
fn a_node_that_was_there_a_moment_ago_is_asked_on_for_a_second() {
    // Node 7 always, node 8 until 3 s.
    let mut world = World::new(T7_PERIOD, |address, at| address == 7 || (address == 8 && at < 3_000_000));
    let mut probes = |from: u64, until: u64| {
        world.run(from);
        let before = world.asked[8];
        world.run(until);
        world.asked[8] - before
    };
    // Every reading and its retry, no sooner than the late answer allows: every 27 ms.
    let asked = probes(3_000_000, 4_000_000);
    assert!(asked >= 30, "{asked}");
    // Then ever less often: the bus is idle, so it is the pauses that count.
    let probed = probes(4_100_000, 5_100_000);
    assert!((10..=30).contains(&probed), "{probed}");
    let probed = probes(30_000_000, 32_400_000);
    assert!((2..=3).contains(&probed), "{probed}");
}

#[test]
fn a_node_that_comes_back_is_noticed() {
    // All are dead but node 7 until 5 s, then all are there; the bus can serve them all.
    let mut world = World::new(Duration::from_millis(200), |address, at| address == 7 || at > 5_000_000);
    world.run(5_000_000);
    let asked = world.asked;
    world.run(5_000_000 + 2_000_000);
    for (address, (before, after)) in asked.into_iter().zip(world.asked).enumerate().skip(1) {
        assert!(after > before, "{address}");
    }
    world.run(8_000_000);
    let readings = (0..NODES).map(|index| world.gateway.slots[usize::from(index)].slot.reading(index));
    assert!(
        readings
            .into_iter()
            .all(|reading| reading.status(Instant::from_micros(8_000_000)) != Status::NoAnswer)
    );
}
