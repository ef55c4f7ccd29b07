//! Hours of a gateway whose sensors move, fall silent, and answer damaged, torn and late: never a wrong angle, never a
//! slot that stays away, and the same run for the same seed.

use super::world::{Chance, Fate, Sensors, World, isu_slot, t7_slot};
use super::*;
use clino_bus::Duration;
use clino_codec::angle::Angle;

const SECOND: u64 = 1_000_000;
const MINUTE: u64 = 60 * SECOND;
const T7S: u8 = 6;
const ISUS: u8 = 3;

/// Every sensor turns at 3°/s times its number. Faults come by chance, and nodes go away for a while.
struct Plant {
    chance: Chance,
    /// Until when a node is away, by bus and node.
    away: std::collections::BTreeMap<(u8, u8), u64>,
    /// Everything that was published, as one number (FNV-1a).
    digest: u64,
    readings: u64,
    faults: u64,
    /// When each slot was last ok.
    ok_at: [u64; 9],
    /// Longest that a slot had no value,
    longest: u64,
    /// and longest that it had none although its node was there. A node may go away again before it was found.
    longest_there: u64,
}

impl Plant {
    fn new(seed: u64) -> Plant {
        Plant {
            chance: Chance::new(seed),
            away: Default::default(),
            digest: 0xCBF2_9CE4_8422_2325,
            readings: 0,
            faults: 0,
            ok_at: [0; 9],
            longest: 0,
            longest_there: 0,
        }
    }

    fn mdeg(&self, number: u8, now: u64) -> i32 {
        (now / 1_000 * 3 * u64::from(number) % 360_000) as i32 - 180_000
    }

    /// When the node of a slot was last away.
    fn there_since(&self, slot: usize) -> u64 {
        let number = slot as u8 + 1;
        let key = if number <= T7S { (Bus::T7 as u8, number) } else { (Bus::Isu as u8, number - T7S) };
        self.away.get(&key).copied().unwrap_or(0)
    }

    fn mix(&mut self, number: u64) {
        for byte in number.to_le_bytes() {
            self.digest = (self.digest ^ u64::from(byte)).wrapping_mul(0x100_0000_01B3);
        }
    }

    fn watch(&mut self, reading: Reading, now: u64) {
        let status = reading.status(Instant::from_micros(now));
        self.readings += 1;
        self.mix(now << 8 | u64::from(reading.slot));
        self.mix(status as u64);
        let Some(angle) = reading.raw(Instant::from_micros(now)) else { return };
        self.mix(u64::from(angle.udeg().cast_unsigned()));
        let slot = usize::from(reading.slot);
        let truth = Angle::from_mdeg(self.mdeg(reading.slot + 1, now)).unwrap();
        // What it turns while an answer is on its way and an ISU keeps its angle; and what a damaged frame that passes
        // its 8-bit sum may be off without being a jump, at the rate of its slot since the last good angle, while the
        // sensor has turned the other way.
        let (keeps_ms, rate) = if slot < T7S.into() { (30, 180) } else { (600 + 60, 90) };
        let since = (now - self.ok_at[slot]).min(SECOND) / 1_000;
        let moved = (keeps_ms + since) * 3 * u64::from(reading.slot + 1);
        let allowed_jump = 50 + since * rate;
        let error = u64::from(angle.difference(truth).udeg().unsigned_abs()) / 1_000;
        assert!(error <= moved + allowed_jump, "slot {slot} says {angle:?} instead of {truth:?} at {now}");
        if now > MINUTE {
            let there = self.there_since(slot).max(self.ok_at[slot]);
            self.longest = self.longest.max(now - self.ok_at[slot]);
            self.longest_there = self.longest_there.max(now.saturating_sub(there));
        }
        self.ok_at[slot] = now;
    }
}

impl Sensors for Plant {
    fn fate(&mut self, bus: Bus, node: u8, now: u64) -> Fate {
        let key = (bus as u8, node);
        if self.away.get(&key).is_some_and(|&until| now < until) {
            return Fate::Silent;
        }
        let fate = match self.chance.below(10_000) {
            0 => {
                let span = self.chance.below(10 * SECOND);
                self.away.insert(key, now + span);
                Fate::Silent
            }
            1..=20 => Fate::Silent,
            21..=100 => Fate::Damaged,
            101..=130 => Fate::Torn,
            131..=150 => Fate::Late(self.chance.below(20_000)),
            _ => Fate::Well,
        };
        self.faults += u64::from(fate != Fate::Well);
        fate
    }
    fn t7(&self, node: u8, now: u64) -> i32 {
        self.mdeg(node, now)
    }
    fn isu(&self, node: u8, now: u64) -> u16 {
        let measured = now / 533_333 * 533_333;
        let number = T7S + node;
        Angle::from_mdeg(self.mdeg(number, measured)).unwrap().to_turn16()
    }
    fn chance(&mut self) -> &mut Chance {
        &mut self.chance
    }
}

/// Runs for that long and returns what was published, as one number.
fn run(seed: u64, span: u64) -> u64 {
    let mut table: Vec<SlotConfig> =
        (1..=T7S).map(|node| t7_slot(node, Duration::from_millis(100))).collect();
    table.extend((1..=ISUS).map(|node| isu_slot(node, Duration::from_millis(266))));
    // A fault does not make the value before it stale.
    table.iter_mut().for_each(|slot| slot.stale = Duration::from_millis(1_000));
    let mut world = World::new(&table, Plant::new(seed));
    world.run(span, Plant::watch);
    let (t7, isu) = (world.gateway.counters(Bus::T7), world.gateway.counters(Bus::Isu));
    std::println!(
        "{} min, seed {seed}: {} readings, {} faults, {} + {} requests, at most {} ms without a value, {} of them with the node there, digest {:016x}",
        span / MINUTE,
        world.sensors.readings,
        world.sensors.faults,
        t7.requests,
        isu.requests,
        world.sensors.longest / 1_000,
        world.sensors.longest_there / 1_000,
        world.sensors.digest
    );
    assert!(world.sensors.faults > span / MINUTE, "nothing happened");
    // Two seconds to be found, two of bad luck.
    assert!(world.sensors.longest_there <= 4 * SECOND);
    let now = world.now;
    for (slot, &ok_at) in world.sensors.ok_at.iter().enumerate() {
        let there = world.sensors.there_since(slot).max(ok_at);
        assert!(now.saturating_sub(there) <= 4 * SECOND, "slot {slot}, ok at {ok_at}");
    }
    let minutes = span / MINUTE;
    // 60 a second are asked for, and retries and confirmations of one in a hundred.
    assert!((3_400 * minutes..3_900 * minutes).contains(&u64::from(t7.requests)), "{}", t7.requests);
    world.sensors.digest
}

#[test]
fn ten_minutes_with_faults_are_right_and_the_same_for_the_same_seed() {
    let first = run(1, 10 * MINUTE);
    assert_eq!(run(1, 10 * MINUTE), first);
    assert_ne!(run(2, 10 * MINUTE), first);
}

/// Two days of it daily, or `CLINO_DAYS`; `cargo xtask campaign core` makes a month of it, with several seeds.
#[test]
fn days_with_faults_are_right() {
    let number = |name, usual| std::env::var(name).map_or(usual, |text| text.parse().expect("a number"));
    run(number("CLINO_SEED", 1), number("CLINO_DAYS", 2) * 24 * 60 * MINUTE);
    // Nothing grows: this is all the memory there is.
    std::println!("the gateway takes {} bytes (on this machine)", size_of::<Gateway>());
}

#[test]
#[ignore = "minutes: `cargo xtask campaign core`"]
fn twenty_four_hours_with_faults_are_right_and_the_same_for_the_same_seed() {
    let first = run(1, 24 * 60 * MINUTE);
    assert_eq!(run(1, 24 * 60 * MINUTE), first);
}
