//! ISUs that refresh independently: every angle is found, and soon.

use super::world::{Chance, Fate, Sensors, World, isu_slot};
use super::*;
use clino_bus::Duration;

/// ISUs, each with a clock of its own, up to 0.5 % off, and a new code at every refresh.
struct Modules {
    chance: Chance,
    /// Instant of the first refresh and time to the next, in µs.
    clocks: Vec<(u64, u64)>,
    /// The first refresh that was not read yet, by node; `None` before the first reading.
    expected: Vec<Option<u64>>,
    missed: u32,
    /// Readings called new that were not, or the other way round.
    misjudged: u32,
    /// Longest time from a refresh to the end of the answer that carries it.
    oldest: u64,
    /// From when on the ages count.
    settled: u64,
}

impl Modules {
    /// `ours`: how far our clock is off, in parts per million. A clock that is fast makes their time long.
    fn new(nodes: u64, seed: u64, ours: i64) -> Modules {
        let mut chance = Chance::new(seed);
        let told = |us: u64| us.saturating_add_signed(us as i64 * ours / 1_000_000);
        let clock = |chance: &mut Chance| (chance.below(533_333), told(530_700 + chance.below(5_300)));
        let clocks = (0..nodes).map(|_| clock(&mut chance)).collect::<Vec<_>>();
        let expected = clocks.iter().map(|_| None).collect();
        Modules { chance, clocks, expected, missed: 0, misjudged: 0, oldest: 0, settled: 10_000_000 }
    }

    /// Counts the refreshes.
    fn refresh(&self, node: usize, now: u64) -> u64 {
        let (first, period) = self.clocks[node];
        (now + period - first) / period
    }

    fn watch(&mut self, reading: Reading, now: u64) {
        let Some(raw) = reading.raw(Instant::from_micros(now)) else { return };
        let node = usize::from(reading.slot);
        let refresh = self.refresh(node, now);
        // The code says which one was read: the one before, if it has changed while the answer was on its way.
        let read = if raw.to_turn16() == code(refresh) { refresh } else { refresh - 1 };
        assert_eq!(raw.to_turn16(), code(read), "{reading:?}");
        let is_new = self.expected[node].is_none_or(|expected| read >= expected);
        self.misjudged += u32::from(reading.is_fresh() != is_new);
        if let Some(expected) = self.expected[node].filter(|_| is_new) {
            self.missed += (read - expected) as u32;
            if now > self.settled {
                let (first, period) = self.clocks[node];
                self.oldest = self.oldest.max(now - (first + (read - 1) * period));
            }
        }
        self.expected[node] = Some(self.expected[node].unwrap_or(0).max(read + 1));
    }
}

fn code(refresh: u64) -> u16 {
    (refresh * 100) as u16
}

impl Sensors for Modules {
    fn fate(&mut self, _: Bus, _: u8, _: u64) -> Fate {
        Fate::Well
    }
    fn t7(&self, _: u8, _: u64) -> i32 {
        unreachable!("there are none")
    }
    fn isu(&self, node: u8, now: u64) -> u16 {
        code(self.refresh(usize::from(node) - 1, now))
    }
    fn chance(&mut self) -> &mut Chance {
        &mut self.chance
    }
}

/// Two minutes of `nodes` modules.
fn watched(nodes: u8, period: Duration, seed: u64, ours: i64) -> World<Modules> {
    let table: Vec<SlotConfig> = (1..=nodes).map(|node| isu_slot(node, period)).collect();
    let mut world = World::new(&table, Modules::new(nodes.into(), seed, ours));
    world.run(120_000_000, |modules, reading, now| modules.watch(reading, now));
    world
}

/// With a right clock. Returns how many refreshes were missed, the oldest angle in ms, and the requests of one module a
/// second.
fn two_minutes(nodes: u8, period: Duration, seed: u64) -> (u32, u64, f64) {
    let world = watched(nodes, period, seed, 0);
    assert_eq!(world.sensors.misjudged, 0);
    let requests = f64::from(world.asked(Bus::Isu, 1)) / 120.0;
    (world.sensors.missed, world.sensors.oldest / 1_000, requests)
}

#[test]
fn no_refresh_is_missed_and_each_is_found_soon() {
    for seed in 0..10 {
        for (nodes, period) in [(1, 266), (1, 533), (14, 266), (14, 533)] {
            let (missed, oldest, requests) = two_minutes(nodes, Duration::from_millis(period), seed);
            if seed == 0 {
                std::println!(
                    "{nodes} ISU every {period} ms: {missed} missed, the oldest {oldest} ms, {requests:.2} requests/s each"
                );
            }
            assert_eq!(missed, 0, "{nodes} nodes every {period} ms, seed {seed}");
            // The span in which it is expected, 25 ms, and what is left of it after an exchange; with 14, what half of
            // the others take.
            let limit = if nodes == 1 { 40 } else { 40 + 7 * 14 };
            assert!(oldest <= limit, "{nodes} nodes every {period} ms, seed {seed}: {oldest} ms");
        }
    }
}

#[test]
fn a_module_asked_seldom_is_not_followed() {
    let (missed, _, requests) = two_minutes(1, Duration::from_millis(2_000), 1);
    assert!(missed > 100);
    assert!((0.49..=0.52).contains(&requests), "{requests}");
}

/// Our clock off by as much as the internal oscillator can be: −8 to 4.5 % (DS8626 table 39), and beyond. Every angle
/// is still the one that was measured; what suffers is how soon it is found, and whether it is known to be new.
#[test]
fn with_an_inexact_clock_no_angle_is_wrong_and_none_is_missed_at_the_usual_period() {
    for ours in [-80_000, -45_000, -33_300, -20_000, 20_000, 33_300, 45_000, 80_000] {
        for (nodes, period) in [(1, 266), (1, 533), (14, 266), (14, 533)] {
            let world = watched(nodes, Duration::from_millis(period), 1, ours);
            let Modules { missed, misjudged, oldest, .. } = world.sensors;
            let what = std::format!(
                "{ours} ppm, {nodes} ISU every {period} ms: {missed} missed, {misjudged} misjudged, the oldest {} ms",
                oldest / 1_000
            );
            std::println!("{what}");
            // 225 a module in two minutes.
            let refreshes = 225 * u32::from(nodes);
            if period == 266 {
                assert_eq!(missed, 0, "{what}");
            }
            assert!(missed * 12 <= refreshes && oldest <= 600_000, "{what}");
            // To a slow clock a new angle comes early, never late.
            let most = if ours < 0 { 0 } else { refreshes * 3 / 10 };
            assert!(misjudged <= most, "{what}");
        }
    }
}
