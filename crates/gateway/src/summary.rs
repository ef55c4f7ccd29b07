//! How the gateway is doing as a whole: what the status word, the bitmaps, `list` and the stream say follows from the
//! parts here, and nowhere else.
//!
//! No part that declares a fault leaves the summary clean, and no slot of a bus that is out of order is online,
//! whatever was received from it: characters on such a bus are no sign of life.

use crate::alarm::Alarms;
use crate::config::{Bus, MAX_SLOTS, Source};
use crate::health::Health;
use crate::schedule::outage::BusFault;
use crate::value::Status;

const _: () = assert!(MAX_SLOTS <= u64::BITS as usize);

/// The status word of the gateway as a whole, a bit for each signal. Bits never change their meaning: they are part of
/// the register map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Signals(u16);

impl Signals {
    /// No enabled slot of the T7 bus answers.
    pub const T7_BUS_DEAD: Signals = Signals(1 << 0);
    /// No enabled slot of the ISU bus answers.
    pub const ISU_BUS_DEAD: Signals = Signals(1 << 1);
    /// A line driver had to be switched off by force.
    pub const DRIVER_FORCED: Signals = Signals(1 << 2);
    /// The configuration in force is not the one that is stored.
    pub const UNSAVED: Signals = Signals(1 << 3);
    /// A command of the Modbus master is under way.
    pub const COMMAND: Signals = Signals(1 << 4);
    /// Safe mode: no bus is served.
    pub const SAFE_MODE: Signals = Signals(1 << 5);
    /// Time and bit rates come from the internal oscillator.
    pub const INTERNAL_CLOCK: Signals = Signals(1 << 6);
    /// The previous run ended in a crash.
    pub const CRASHED: Signals = Signals(1 << 7);
    /// The T7 bus is out of order.
    pub const T7_BUS_FAULT: Signals = Signals(1 << 8);
    /// The ISU bus is out of order.
    pub const ISU_BUS_FAULT: Signals = Signals(1 << 9);
    /// An enabled slot has no right and fresh angle.
    pub const SLOT_FAULT: Signals = Signals(1 << 10);
    /// An enabled slot gives a health signal.
    pub const HEALTH: Signals = Signals(1 << 11);
    /// A commissioning task is under way, or has ended and its result was not fetched yet.
    pub const TASK: Signals = Signals(1 << 12);
    /// An alarm of a slot is active, or waits for its acknowledgement.
    pub const ALARM: Signals = Signals(1 << 13);

    /// All of them, by bit, with the names used in every interface and their meanings.
    pub const ALL: [(Signals, &str, &str); 14] = [
        (Signals::T7_BUS_DEAD, "t7_bus_dead", "no enabled slot of the T7 bus answers"),
        (Signals::ISU_BUS_DEAD, "isu_bus_dead", "no enabled slot of the ISU bus answers"),
        (
            Signals::DRIVER_FORCED,
            "driver_forced",
            "a line driver had to be switched off by force since reset, or since the counters were cleared",
        ),
        (
            Signals::UNSAVED,
            "unsaved",
            "the configuration in force is not the one that the next start has, or that is not known (bare mode)",
        ),
        (Signals::COMMAND, "command", "a command is under way"),
        (Signals::SAFE_MODE, "safe_mode", "safe mode: no bus is served; see *start_mode*"),
        (
            Signals::INTERNAL_CLOCK,
            "internal_clock",
            "time and bit rates come from the internal oscillator, up to 8 % off",
        ),
        (Signals::CRASHED, "crashed", "the previous run ended in a crash; see *start_cause*"),
        (Signals::T7_BUS_FAULT, "t7_bus_fault", "the T7 bus is out of order; see *fault* of the bus"),
        (Signals::ISU_BUS_FAULT, "isu_bus_fault", "the ISU bus is out of order; see *fault* of the bus"),
        (
            Signals::SLOT_FAULT,
            "slot_fault",
            "a slot that is switched on has no right and fresh angle; see *valid*",
        ),
        (
            Signals::HEALTH,
            "health",
            "a slot that is switched on gives a signal beside its value; see its *flags*",
        ),
        (Signals::TASK, "task", "a task runs on a bus, or has ended and its result was not fetched yet"),
        (Signals::ALARM, "alarm", "an alarm of a slot is active, or waits for its acknowledgement"),
    ];

    /// As bits.
    pub const fn bits(self) -> u16 {
        self.0
    }

    /// Whether no signal is set: all is as it should be.
    pub const fn is_clean(self) -> bool {
        self.0 == 0
    }

    /// Whether one of these is among them.
    pub const fn has(self, other: Signals) -> bool {
        self.0 & other.0 != 0
    }

    /// The names of those that are set.
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        let bits = (0..u16::BITS).map(move |bit| self.0.wrapping_shr(bit) & 1 != 0);
        NAMES.iter().zip(bits).filter(|&(_, is_set)| is_set).map(|(name, _)| *name)
    }

    const fn when(self, on: bool) -> Signals {
        if on { self } else { Signals(0) }
    }

    const fn and(self, other: Signals) -> Signals {
        Signals(self.0 | other.0)
    }
}

/// The names by bit: what they mean is for documents, and not in the image.
#[allow(clippy::indexing_slicing, clippy::arithmetic_side_effects, reason = "runs in the compiler only")]
static NAMES: [&str; Signals::ALL.len()] = {
    let mut names = [""; Signals::ALL.len()];
    let mut at = 0;
    while at < names.len() {
        names[at] = Signals::ALL[at].1;
        at += 1;
    }
    names
};

/// What a bus declares.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BusPart {
    /// Why no node on it answers.
    pub fault: Option<BusFault>,
    /// Its driver had to be switched off by force.
    pub forced: bool,
    /// It has a task, or a task has ended and its requester has not fetched the end yet.
    pub task: bool,
}

/// What the parts of the gateway declare, its slots left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Parts {
    /// The T7 bus.
    pub t7: BusPart,
    /// The ISU bus.
    pub isu: BusPart,
    /// What is in force is not what is stored.
    pub unsaved: bool,
    /// A command of the Modbus master is under way.
    pub command: bool,
    /// No bus is served.
    pub safe_mode: bool,
    /// Time comes from the internal oscillator.
    pub internal_clock: bool,
    /// The previous run ended in a crash.
    pub crashed: bool,
}

/// What a slot declares.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Standing {
    /// What it reads.
    pub source: Source,
    /// What its value is worth now.
    pub status: Status,
    /// Signals beside the value.
    pub health: Health,
    /// The state of its alarms.
    pub alarms: Alarms,
    /// Time since its last good value, in milliseconds, if there was one.
    pub age_ms: Option<u64>,
}

/// The gateway as a whole.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Summary {
    /// The status word.
    pub signals: Signals,
    /// A bit for each slot that gave a sign of life when it was last asked.
    pub online: u64,
    /// A bit for each slot whose angle is right and fresh.
    pub valid: u64,
    /// A bit for each slot with an alarm that is active or waits for its acknowledgement.
    pub alarms: u64,
    /// Slots that are switched on.
    pub enabled: u8,
    /// The greatest age of these, in milliseconds; [`NEVER`] if one has none.
    pub oldest_ms: u64,
}

/// The age of a value that there never was, in milliseconds: older than any.
pub const NEVER: u64 = u64::MAX;

/// The slots that were counted so far.
#[derive(Default)]
struct Tally {
    summary: Summary,
    /// Slots that are switched on, and those of them that are online, by bus.
    on: [(u8, u8); 2],
    health: bool,
}

impl Tally {
    #[inline(never)]
    fn count(&mut self, index: usize, standing: &Standing, parts: &Parts) {
        let Standing { source, status, health, alarms, age_ms } = *standing;
        if status == Status::Disabled {
            return;
        }
        let bus = source.bus();
        let faulty = match bus {
            Some(Bus::T7) => parts.t7.fault.is_some(),
            Some(Bus::Isu) => parts.isu.fault.is_some(),
            None => false,
        };
        let online = status.is_online() && !faulty && !source.is_faulty();
        let bit = 1_u64.wrapping_shl(index as u32);
        let summary = &mut self.summary;
        summary.enabled = summary.enabled.saturating_add(1);
        summary.online |= if online { bit } else { 0 };
        summary.valid |= if status == Status::Ok { bit } else { 0 };
        summary.alarms |= if alarms.is_quiet() { 0 } else { bit };
        summary.oldest_ms = summary.oldest_ms.max(age_ms.unwrap_or(NEVER));
        self.health |= health != Health::WELL;
        if let Some((enabled, answering)) = bus.and_then(|bus| self.on.get_mut(bus as usize)) {
            *enabled = enabled.saturating_add(1);
            *answering = answering.saturating_add(online.into());
        }
    }

    #[inline(never)]
    fn signals(&self, parts: &Parts) -> Signals {
        let Parts { t7, isu, unsaved, command, safe_mode, internal_clock, crashed } = *parts;
        let dead = |(enabled, answering): (u8, u8)| enabled > 0 && answering == 0;
        let [on_t7, on_isu] = self.on;
        let signals = [
            (Signals::T7_BUS_DEAD, dead(on_t7)),
            (Signals::ISU_BUS_DEAD, dead(on_isu)),
            (Signals::DRIVER_FORCED, t7.forced || isu.forced),
            (Signals::UNSAVED, unsaved),
            (Signals::COMMAND, command),
            (Signals::SAFE_MODE, safe_mode),
            (Signals::INTERNAL_CLOCK, internal_clock),
            (Signals::CRASHED, crashed),
            (Signals::T7_BUS_FAULT, t7.fault.is_some()),
            (Signals::ISU_BUS_FAULT, isu.fault.is_some()),
            (Signals::SLOT_FAULT, self.summary.good() < self.summary.enabled.into()),
            (Signals::HEALTH, self.health),
            (Signals::TASK, t7.task || isu.task),
            (Signals::ALARM, self.summary.alarms != 0),
        ];
        signals.into_iter().fold(Signals(0), |all, (signal, on)| all.and(signal.when(on)))
    }
}

impl Summary {
    /// Sums up the slots, which `slot` returns until there is none, and the other parts.
    pub fn of(slot: impl Fn(usize) -> Option<Standing>, parts: &Parts) -> Summary {
        let mut tally = Tally::default();
        for (index, standing) in (0..MAX_SLOTS).map_while(|index| Some((index, slot(index)?))) {
            tally.count(index, &standing, parts);
        }
        Summary { signals: tally.signals(parts), ..tally.summary }
    }

    /// Of the slots that are switched on, those whose angle is right and fresh.
    pub const fn good(&self) -> u32 {
        count(self.valid)
    }
}

/// How many slots there are in a set. The processor has no instruction for that: 64 bytes of code.
#[inline(never)]
pub const fn count(slots: u64) -> u32 {
    slots.count_ones()
}

#[cfg(test)]
mod tests;
