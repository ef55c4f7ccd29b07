//! Configuration warnings: settings that are allowed, and probably a mistake.
//!
//! Not among them: an ISU and a T7 on one segment. Each protocol has its own, and no table can say otherwise
//! ([`Source::bus`]).
//!
//! The load of a bus is computed from its documents' figures: request, latency, answer, guard.
//!
//! | | request | latency | answer | sum |
//! |---|---|---|---|---|
//! | T7, one angle, 115200 bit/s | 3 characters | 2 ms | 8 characters | 3.04 ms |
//! | T7, everything | 3 characters | 2 ms | 34 characters | 5.30 ms |
//! | ISU, 9600 bit/s | 5 characters | 1 ms | 6 characters | 13.5 ms |

use core::fmt;

use clino_bus::Duration;

use crate::config::{Ask, Bus, Filter, Kind, SlotConfig, Source};

use crate::schedule::refresh::REFRESH;
use crate::settings::BusSettings;

/// Shortest averaging time that has an effect: the sensor's bandwidth is 8 Hz (T7 data sheet).
pub const SHORTEST_DAMPING_MS: u16 = 125;
/// An ISU switches its driver on 1 ms before its first bit (AN #201 section 2, TXEN); no other latency is documented.
const ISU_LATENCY: Duration = Duration::from_micros(1_000);
/// With fewer periods before a value is stale, one reading that fails makes it so.
const STALE_PERIODS: u32 = 2;
/// Characters of requests and answers.
const T7_REQUEST: u32 = 3;
const T7_ANGLE: u32 = 8;
const T7_EVERYTHING: u32 = 34;
const ISU_REQUEST: u32 = 5;
const ISU_ANGLE: u32 = 6;
const PERCENT: u64 = 100;
/// Parts of a percent in which loads are added up.
const PARTS: u64 = 1_000;

/// A configuration warning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Finding {
    /// Two slots read the same source.
    Duplicate {
        /// A slot.
        slot: u8,
        /// One before it.
        same_as: u8,
    },
    /// An address to which every node answers, with several nodes on the bus.
    AllAnswer {
        /// The slot.
        slot: u8,
        /// Its address.
        address: u8,
        /// Nodes on the bus.
        nodes: u8,
    },
    /// The periods ask for more than the bus can carry; periods of zero left out.
    Overload {
        /// The bus.
        bus: Bus,
        /// What they ask for.
        percent: u32,
    },
    /// An ISU has a new angle every 533 ms; the readings in between repeat it.
    Repeats {
        /// The slot.
        slot: u8,
        /// Its period.
        period: Duration,
    },
    /// A T7 that averages over less than its sensor's bandwidth.
    Damping {
        /// The slot.
        slot: u8,
        /// Averaging time.
        damping_ms: u16,
    },
    /// A silent sensor costs more than its period.
    Timeout {
        /// The slot.
        slot: u8,
        /// Its timeout.
        timeout: Duration,
        /// Its period.
        period: Duration,
    },
    /// One reading that fails makes the value stale.
    Stale {
        /// The slot.
        slot: u8,
        /// Its stale limit.
        stale: Duration,
        /// Its period.
        period: Duration,
    },
    /// A filter over one angle does nothing.
    OneSample {
        /// The slot.
        slot: u8,
    },
    /// The slot has a kind and no address of that kind.
    Incomplete {
        /// The slot.
        slot: u8,
        /// Its kind.
        kind: Kind,
        /// The number that is set as its address.
        address: u8,
    },
    /// Our driver may come on while an answer ends.
    Guard {
        /// The bus.
        bus: Bus,
        /// Its guard.
        guard: Duration,
        /// One character.
        character: Duration,
    },
    /// Our driver may still be on when an answer begins.
    Post {
        /// The bus.
        bus: Bus,
        /// Its delay after a frame.
        post: Duration,
    },
    /// The partner of a PWM input is a slot that reads no ISU.
    Partner {
        /// The slot.
        slot: u8,
        /// Its partner.
        partner: u8,
    },
}

/// A value in the words of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// A number.
    Number(u32),
    /// A name.
    Name(&'static str),
}

impl Finding {
    /// Its sentence, in which `{0}` stands for the first of the values behind it.
    pub fn words(&self) -> (&'static str, [Part; 3]) {
        let none = Part::Number(0);
        let number = |number: u8| Part::Number(number.into());
        let ms = |span: Duration| Part::Number(span.as_millis());
        let us = |span: Duration| Part::Number(span.as_micros());
        match *self {
            Finding::Duplicate { slot, same_as } => {
                ("slot {0} reads the same as slot {1}", [number(slot), number(same_as), none])
            }
            Finding::AllAnswer { slot, address, nodes } => (
                "slot {0}: all {2} nodes answer to address {1}",
                [number(slot), number(address), number(nodes)],
            ),
            Finding::Overload { bus, percent } => (
                "bus {0}: its slots ask for {1} % of what it can carry",
                [Part::Name(bus.name()), Part::Number(percent), none],
            ),
            Finding::Repeats { slot, period } => {
                ("slot {0}: asked every {1} ms, new every 533 ms", [number(slot), ms(period), none])
            }
            Finding::Damping { slot, damping_ms } => (
                "slot {0}: damping {1} ms is less than the {2} ms of its bandwidth",
                [number(slot), Part::Number(damping_ms.into()), Part::Number(SHORTEST_DAMPING_MS.into())],
            ),
            Finding::Timeout { slot, timeout, period } => (
                "slot {0}: timeout {1} ms is longer than period {2} ms",
                [number(slot), ms(timeout), ms(period)],
            ),
            Finding::Stale { slot, stale, period } => (
                "slot {0}: stale {1} ms, period {2} ms: one reading that fails makes it stale",
                [number(slot), ms(stale), ms(period)],
            ),
            Finding::OneSample { slot } => {
                ("slot {0}: a filter over 1 sample does nothing", [number(slot), none, none])
            }
            Finding::Incomplete { slot, kind, address } => (
                "slot {0}: it is not read, kind {1} at address {2}",
                [number(slot), Part::Name(kind.name()), number(address)],
            ),
            Finding::Guard { bus, guard, character } => (
                "bus {0}: guard {1} us is shorter than one character, {2} us: frames may collide",
                [Part::Name(bus.name()), us(guard), us(character)],
            ),
            Finding::Post { bus, post } => (
                "bus {0}: post {1} us: an answer that begins sooner collides with our driver",
                [Part::Name(bus.name()), us(post), none],
            ),
            Finding::Partner { slot, partner } => {
                ("slot {0}: slot {1} reads no ISU", [number(slot), number(partner), none])
            }
        }
    }
}

/// For hosts: the image fills the sentence in without `core::fmt`.
impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (sentence, values) = self.words();
        let mut pieces = sentence.split(['{', '}']);
        f.write_str(pieces.next().unwrap_or(""))?;
        while let (Some(place), Some(text)) = (pieces.next(), pieces.next()) {
            match place.parse::<usize>().ok().and_then(|place| values.get(place)) {
                Some(Part::Number(number)) => write!(f, "{number}")?,
                Some(Part::Name(name)) => f.write_str(name)?,
                None => {}
            }
            f.write_str(text)?;
        }
        Ok(())
    }
}

/// The configuration to check: the table, the buses, and the averaging time of a slot's T7 where it is known.
#[derive(Clone, Copy)]
pub struct Lint<'a> {
    /// How a slot is set; `None` beyond the last one.
    pub slot: &'a dyn Fn(u8) -> Option<SlotConfig>,
    /// How the T7 bus runs.
    pub t7: &'a BusSettings,
    /// How the ISU bus runs.
    pub isu: &'a BusSettings,
    /// Averaging time of the T7 in a slot, in milliseconds.
    pub damping_ms: fn(u8) -> Option<u16>,
}

impl<'a> Lint<'a> {
    /// Calls `found` with each warning.
    pub fn findings(self, found: &mut dyn FnMut(Finding)) {
        for bus in Bus::ALL {
            if let Some(overload) = self.overload(bus) {
                found(overload);
            }
            self.of_bus(bus, found);
        }
        for slot in 0..=u8::MAX {
            if self.of_slot(slot, found).is_none() {
                break;
            }
        }
        self.each(&mut |slot, SlotConfig { source, .. }| {
            if source.is_faulty() {
                found(Finding::Incomplete { slot, kind: source.kind(), address: source.address() });
            }
        });
    }

    /// Looks at each slot, used or not.
    #[inline(never)]
    fn each(&self, look: &mut dyn FnMut(u8, &SlotConfig)) {
        for slot in 0..=u8::MAX {
            let Some(config) = &(self.slot)(slot) else { return };
            look(slot, config);
        }
    }

    #[inline(never)]
    fn of_bus(&self, bus: Bus, found: &mut dyn FnMut(Finding)) {
        let BusSettings { timing, line } = self.bus(bus);
        let character = timing.serial.characters(1);
        if timing.guard < character {
            found(Finding::Guard { bus, guard: timing.guard, character });
        }
        if line.post_delay > character {
            found(Finding::Post { bus, post: line.post_delay });
        }
    }

    const fn bus(&self, bus: Bus) -> &'a BusSettings {
        match bus {
            Bus::T7 => self.t7,
            Bus::Isu => self.isu,
        }
    }

    /// What the periods of a bus's slots ask for, in percent of what it can carry; periods of zero left out.
    #[inline(never)]
    pub fn load(&self, bus: Bus) -> u32 {
        let mut sum: u64 = 0;
        self.each(&mut |_, config| {
            if config.is_on() && config.bus() == Some(bus) {
                let span = u64::from(self.exchange(config).as_micros());
                let parts = span.saturating_mul(PERCENT.saturating_mul(PARTS));
                let parts = parts.checked_div(u64::from(config.period.as_micros())).unwrap_or(0);
                sum = sum.saturating_add(parts);
            }
        });
        u32::try_from(sum.div_ceil(PARTS)).unwrap_or(u32::MAX)
    }

    fn exchange(&self, config: &SlotConfig) -> Duration {
        let Some(bus) = config.source.bus() else { return Duration::ZERO };
        let timing = &self.bus(bus).timing;
        let (latency, characters) = match (bus, config.ask) {
            (Bus::Isu, _) => (ISU_LATENCY, ISU_REQUEST.saturating_add(ISU_ANGLE)),
            (Bus::T7, Ask::Everything) => (timing.get_latency, T7_REQUEST.saturating_add(T7_EVERYTHING)),
            (Bus::T7, Ask::Angle) => (timing.get_latency, T7_REQUEST.saturating_add(T7_ANGLE)),
        };
        timing.serial.characters(characters) + latency + timing.guard
    }

    fn overload(&self, bus: Bus) -> Option<Finding> {
        let percent = self.load(bus);
        (u64::from(percent) > PERCENT).then_some(Finding::Overload { bus, percent })
    }

    /// Warnings about a slot; `None` beyond the last one.
    #[inline(never)]
    fn of_slot(&self, slot: u8, found: &mut dyn FnMut(Finding)) -> Option<()> {
        let config = (self.slot)(slot);
        let config = config.as_ref()?;
        if !config.is_on() {
            return Some(());
        }
        if let Some(same_as) = self.earlier(slot, config.source) {
            found(Finding::Duplicate { slot, same_as });
        }
        if let Some(all_answer) = self.all_answer(slot, config) {
            found(all_answer);
        }
        let period = config.period;
        // Asked twice, a value is half a refresh old at most when it is read; more frequent readings repeat it.
        if matches!(config.source, Source::Isu { .. })
            && period.times(2) + Duration::from_micros(2_000) < REFRESH
        {
            found(Finding::Repeats { slot, period });
        }
        if matches!(config.source, Source::T7 { .. })
            && let Some(damping_ms) = (self.damping_ms)(slot).filter(|&ms| ms < SHORTEST_DAMPING_MS)
        {
            found(Finding::Damping { slot, damping_ms });
        }
        let timeout = config.timeout;
        if config.source.bus().is_some() && period > Duration::ZERO && timeout > period {
            found(Finding::Timeout { slot, timeout, period });
        }
        if config.stale_after() < config.period.times(STALE_PERIODS) {
            found(Finding::Stale { slot, stale: config.stale_after(), period });
        }
        if config.filter != Filter::Off && config.samples == 1 {
            found(Finding::OneSample { slot });
        }
        if let Some(partner) = config.partner.filter(|&partner| !self.reads_isu(partner)) {
            found(Finding::Partner { slot, partner });
        }
        Some(())
    }

    /// The first slot before this one that reads the same source.
    #[inline(never)]
    fn earlier(&self, slot: u8, source: Source) -> Option<u8> {
        let mut first = None;
        self.each(&mut |other, config| {
            if other < slot && config.is_on() && config.source == source {
                first = first.or(Some(other));
            }
        });
        first
    }

    #[inline(never)]
    fn all_answer(&self, slot: u8, config: &SlotConfig) -> Option<Finding> {
        let (bus, address) = config.source.node()?;
        let for_all = match config.source {
            Source::T7 { address, .. } => address.is_all(),
            Source::Isu { address } => address.is_any(),
            Source::Pwm { .. } | Source::Incomplete { .. } | Source::Off => false,
        };
        if !for_all {
            return None;
        }
        let mut seen: u128 = 0;
        self.each(&mut |_, config| match config.source.node() {
            Some((other, node)) if other == bus && config.is_on() => {
                seen |= 1_u128.wrapping_shl((node & 0x7F).into());
            }
            _ => {}
        });
        let nodes = seen.count_ones() as u8;
        (nodes > 1).then_some(Finding::AllAnswer { slot, address, nodes })
    }

    fn reads_isu(&self, slot: u8) -> bool {
        (self.slot)(slot).is_some_and(|config| matches!(config.source, Source::Isu { .. }) && config.enabled)
    }
}

#[cfg(test)]
mod tests;
