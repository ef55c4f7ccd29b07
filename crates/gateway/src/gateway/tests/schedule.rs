//! Which node is asked when, while nodes fail and return at random.

use super::world::{Chance, Fate, Sensors, World, isu_slot, t7_slot};
use super::*;
use crate::config::Filter;
use crate::order::Order;
use crate::task;
use crate::trace::{Entry, Purpose, Verdict};
use clino_bus::Duration;
use clino_codec::angle::Angle;
use clino_commissioning::t7::Device;

const SECOND: u64 = 1_000_000;

/// Nodes that are there or not, by a function of bus, node and time.
struct Coming<F>(F, Chance);

impl<F: Fn(Bus, u8, u64) -> bool> Sensors for Coming<F> {
    fn fate(&mut self, bus: Bus, node: u8, now: u64) -> Fate {
        if (self.0)(bus, node, now) { Fate::Well } else { Fate::Silent }
    }
    fn t7(&self, node: u8, _: u64) -> i32 {
        i32::from(node) * 1_000
    }
    fn isu(&self, node: u8, _: u64) -> u16 {
        u16::from(node) << 8
    }
    fn chance(&mut self) -> &mut Chance {
        &mut self.1
    }
}

fn world<F: Fn(Bus, u8, u64) -> bool>(table: &[SlotConfig], there: F) -> World<Coming<F>> {
    World::new(table, Coming(there, Chance::new(1)))
}

fn t7_table(nodes: u8, period: Duration) -> Vec<SlotConfig> {
    (1..=nodes).map(|node| t7_slot(node, period)).collect()
}

/// Good answers of a second, once the gateway has found the dead nodes.
fn rate(table: &[SlotConfig], there: impl Fn(Bus, u8, u64) -> bool) -> f64 {
    let mut world = world(table, there);
    world.skip(3 * SECOND);
    let before = world.gateway.counters(Bus::T7).good;
    world.skip(13 * SECOND);
    f64::from(world.gateway.counters(Bus::T7).good - before) / 10.0
}

#[test]
fn with_16_of_32_dead_the_living_keep_95_percent_of_their_rate() {
    for (period, part) in [(Duration::ZERO, 0.95), (Duration::from_millis(100), 0.999)] {
        let alone = rate(&t7_table(16, period), |_, _, _| true);
        let with_dead = rate(&t7_table(32, period), |_, node, _| node <= 16);
        std::println!("period {} us: {with_dead}/s beside 16 dead, {alone}/s without", period.as_micros());
        assert!(with_dead >= part * alone, "{with_dead} of {alone}");
    }
}

#[test]
fn a_node_that_is_back_is_found_within_two_seconds() {
    // Long dead, so that the pauses are at their longest; all of them but one, which is the worst for the others.
    let table: Vec<SlotConfig> = t7_table(32, Duration::from_millis(20))
        .into_iter()
        .chain((1..=14).map(|n| isu_slot(n, Duration::from_millis(266))))
        .collect();
    for back in [60 * SECOND, 61 * SECOND + 100_000, 62 * SECOND + 777_777] {
        let mut world = world(&table, |_, node, now| node == 1 || now >= back);
        world.skip(back);
        assert_eq!((world.status(1), world.status(33)), (Status::NoAnswer, Status::NoAnswer));
        let mut found = [None; MAX_SLOTS];
        world.run(back + 2 * SECOND, |_, reading, now| {
            if reading.status(Instant::from_micros(now)) == Status::Ok {
                found[usize::from(reading.slot)].get_or_insert(now);
            }
        });
        let worst = |slots: core::ops::Range<usize>| {
            slots.map(|slot| found[slot].unwrap_or(u64::MAX)).max().unwrap().saturating_sub(back) / 1_000
        };
        std::println!(
            "back at {back} us: the last T7 after {} ms, the last ISU after {} ms",
            worst(0..32),
            worst(32..46)
        );
        assert!(worst(0..32) <= 2_000 && worst(32..46) <= 2_000);
    }
}

#[test]
fn a_steady_bus_has_no_drift_and_no_extra_requests() {
    let mut world = world(&t7_table(3, Duration::from_millis(20)), |_, _, _| true);
    world.skip(SECOND / 2);
    let before = world.asked.clone();
    world.skip(SECOND / 2 + 100 * SECOND);
    for node in 1..=3 {
        let requests = world.asked(Bus::T7, node) - before[&(Bus::T7 as u8, node)];
        assert_eq!(requests, 5_000, "node {node}");
    }
    assert_eq!(world.gateway.slot_counters(0).unwrap().skipped, 0);
}

#[test]
fn what_the_bus_has_no_time_for_is_counted() {
    // 32 nodes at 3.04 ms each want 20 ms: four of five periods are left out.
    let mut world = world(&t7_table(32, Duration::from_millis(20)), |_, _, _| true);
    world.skip(10 * SECOND);
    for slot in 0..32 {
        let counters = world.gateway.slot_counters(slot).unwrap();
        assert!((95..=106).contains(&counters.requests), "{counters:?}");
        assert!(u32::from(counters.skipped) + 2 >= counters.requests, "{counters:?}");
        assert_eq!(
            counters.first_try,
            counters.requests - u32::from(world.asked(Bus::T7, slot as u8 + 1) > counters.first_try)
        );
    }
}

#[test]
fn a_task_and_the_polling_take_turns() {
    let mut world = world(&t7_table(8, Duration::ZERO), |_, _, _| true);
    world.skip(SECOND);
    let device = Device::at(t7::Address::new(1).unwrap()).unwrap();
    let mut tasks = 0;
    let (good, until) = (world.gateway.counters(Bus::T7).good, 2 * SECOND);
    let mut waits = 0;
    while world.now < until {
        if world.gateway.progress(Bus::T7).is_none() {
            let order = Order::T7(task::t7::Task::Identify(device));
            match world.gateway.carry_out(order, Requester::Console) {
                Ok(()) => tasks += 1,
                Err(_) => waits += 1,
            }
        }
        _ = world.gateway.task_event(Requester::Console);
        let now = world.now;
        world.skip(now + 1_000);
    }
    let readings = world.gateway.trace().iter().filter(|entry| entry.purpose == Purpose::Reading).count();
    let steps = world.gateway.trace().iter().filter(|entry| entry.purpose == Purpose::Task).count();
    assert!(tasks > 10 && waits < tasks, "{tasks} tasks, {waits} waits");
    // One each while there is a task; the polling alone between two.
    assert!(steps >= 6 && readings >= steps, "{readings} readings, {steps} steps");
    assert!(world.gateway.counters(Bus::T7).good - good > 250);
}

#[test]
fn the_trace_tells_what_happened() {
    let mut world = world(&t7_table(2, Duration::from_millis(20)), |_, node, _| node == 1);
    world.skip(SECOND);
    let trace: Vec<_> = world.gateway.trace().iter().copied().collect();
    assert_eq!(trace.len(), crate::trace::TRACED);
    let at = |entry: &Entry| entry.at(Instant::from_micros(world.now));
    assert!(trace.windows(2).all(|pair| at(&pair[0]) > at(&pair[1])), "newest first");
    for entry in &trace {
        let (verdict, purpose, took) = match entry.address() {
            1 => (Verdict::Good, Purpose::Reading, 2_900..3_100),
            _ => (Verdict::NoAnswer, Purpose::Probe, 2_400..2_600),
        };
        assert_eq!(
            (entry.bus(), entry.command, entry.verdict, entry.purpose),
            (Bus::T7, 0x83, verdict, purpose)
        );
        assert!(took.contains(&entry.took().as_micros()), "{entry:?}");
    }
    let all = world.gateway.counters(Bus::T7).requests;
    assert!(world.gateway.trace().total() >= all - 1);
}

#[test]
fn a_slot_counts_what_the_bus_counts() {
    let mut world = world(&t7_table(3, Duration::from_millis(20)), |_, node, now| {
        node != 3 || (now / SECOND).is_multiple_of(2)
    });
    world.skip(10 * SECOND);
    let bus = *world.gateway.counters(Bus::T7);
    let of_slots = |counter: fn(&SlotCounters) -> u32| -> u32 {
        (0..3).map(|slot| counter(world.gateway.slot_counters(slot).unwrap())).sum()
    };
    assert_eq!(of_slots(|c| c.requests), bus.requests);
    assert_eq!(of_slots(|c| c.retries), bus.retries);
    assert_eq!(of_slots(|c| c.no_answer), bus.no_answer);
    assert!(bus.no_answer > 20 && bus.retries > 0);
    let counters = world.gateway.slot_counters(0).unwrap();
    // 2 ms and a character, to 10 µs.
    assert_eq!(
        (counters.response_min(), counters.response_max()),
        (Duration::from_micros(2_080), Duration::from_micros(2_080))
    );
}

#[test]
fn a_filter_a_zero_a_direction_and_a_range() {
    let mut table = t7_table(4, Duration::from_millis(20));
    table[1].soft_zero = Angle::from_udeg(5_000_000);
    table[2].direction = crate::config::Direction::Reversed;
    table[2].range = clino_codec::angle::Range::Unidirectional;
    (table[3].filter, table[3].samples) = (Filter::Median, 5);
    table[3].ask = crate::config::Ask::Everything;
    let mut world = world(&table, |_, _, _| true);
    world.skip(SECOND);
    let now = Instant::from_micros(world.now);
    let readings: Vec<Reading> = (0..4).map(|slot| world.gateway.reading(slot).unwrap()).collect();
    let angles: Vec<i32> = readings.iter().map(|r| r.angle(now).unwrap().mdeg()).collect();
    assert_eq!(angles, [1_000, -3_000, 357_000, 4_000]);
    let raw: Vec<i32> = readings.iter().map(|r| r.raw(now).unwrap().udeg()).collect();
    assert_eq!(raw, [1_000_000, 2_000_000, 3_000_000, 4_000_000]);
    assert_eq!((readings[0].temperature(), readings[3].temperature()), (None, Some(2_300)));
    assert!(readings[3].health == crate::Health::WELL);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Nodes come and go at random. A node that was there for two seconds is read; one that was away for that long
    /// is not; a node that is there is read in time, whatever the others do.
    #[test]
    fn every_node_that_is_there_is_read(
        changes in prop::collection::vec((0_u64..20 * SECOND, 1_u8..=12, any::<bool>(), any::<bool>()), 0..60),
    ) {
        let there = |bus: Bus, node: u8, now: u64| {
            let mine = changes.iter().filter(|&&(at, changed, isu, _)| {
                at <= now && changed == node && isu == (bus == Bus::Isu)
            });
            mine.max_by_key(|change| change.0).is_none_or(|change| change.3)
        };
        let table: Vec<SlotConfig> = t7_table(12, Duration::from_millis(100)).into_iter()
            .chain((1..=6).map(|node| isu_slot(node, Duration::from_millis(266)))).collect();
        let mut world = world(&table, there);
        let mut read_at = [0_u64; 18];
        while world.now < 22 * SECOND {
            let now = world.now;
            world.run(now + SECOND / 10, |_, reading, now| {
                if reading.status(Instant::from_micros(now)) == Status::Ok {
                    read_at[usize::from(reading.slot)] = now;
                }
            });
            let now = world.now;
            for (slot, &read_at) in read_at.iter().enumerate() {
                let (bus, node) = if slot < 12 { (Bus::T7, slot as u8 + 1) } else { (Bus::Isu, slot as u8 - 11) };
                let steady = |span: u64| (0..=span / (SECOND / 20)).all(|n| {
                    there(bus, node, now.saturating_sub(n * SECOND / 20)) == there(bus, node, now)
                }) && changes.iter().all(|&(at, changed, isu, _)| {
                    changed != node || isu != (bus == Bus::Isu) || at > now || at + span < now
                });
                if now > 2 * SECOND && there(bus, node, now) && steady(2 * SECOND) {
                    // Its period, half of one for the others, and the dead ISUs' probes.
                    let limit = if bus == Bus::T7 { 150_000 } else { 700_000 };
                    prop_assert!(now - read_at <= limit, "slot {slot} at {now}: read at {read_at}");
                }
                if !there(bus, node, now) && steady(2 * SECOND) && now > 2 * SECOND {
                    prop_assert_eq!(world.status(slot), Status::NoAnswer, "slot {} at {}", slot, now);
                }
            }
        }
    }
}
