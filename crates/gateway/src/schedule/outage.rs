//! Whether a bus as a whole is out of order, and what that looks like from here.
//!
//! One dead node is no fault of its bus; a bus on which no node answers is faulty. So a bus is declared faulty when,
//! since its last good answer, every slot that was not dead before has been asked in vain [twice](ROUNDS), and the
//! first of them [half a second](FAULTY_AFTER) ago. A request that did not get out at all counts for every slot. The
//! first good answer of any node ends the fault. A refusal is an answer, too: the node has understood the request.
//!
//! The kind of the fault follows from the last round of requests, one to each slot:
//!
//! | fault | seen | causes |
//! |---|---|---|
//! | [`Babble`](BusFault::Babble) | characters before the request was out, in [a quarter](BABBLE_SHARE) of the exchanges at least | a node that transmits without being asked, another master |
//! | [`Driver`](BusFault::Driver) | our own frames do not get out whole | interrupts held off, a defect of the UART |
//! | [`Contention`](BusFault::Contention) | our own characters come back changed or not at all, where they should | a short, another driver that is always on |
//! | [`Break`](BusFault::Break) | nothing but characters of zeros with a low stop bit | the pair shorted or swapped, a driver stuck low |
//! | [`Garbage`](BusFault::Garbage) | other characters, but no answers | wrong bit rate, no termination, noise |
//! | [`Mute`](BusFault::Mute) | nothing at all | cut or shorted pair, DE stuck, no supply, wrong bit rate |
//!
//! Limits: a fault that lets an answer through now and then is no bus fault; it shows in the slots
//! ([`Health::NOISY`](crate::Health::NOISY)) and in the counters. Behind a transceiver whose receiver is off while it
//! drives, a driver that is always on makes the gateway deaf: that is mute, as a cut pair is.

use clino_bus::{BusCounters, Duration, Instant};

use crate::bits::Bits;
use crate::trace::Verdict;

/// Rounds in vain: what hits one round by chance does not hit two.
const ROUNDS: u8 = 2;
/// From the first request in vain to a fault, at least: longer than the bursts of noise that a plant has, shorter than
/// the second after which a node is taken for dead, so that no node of a faulty bus is.
const FAULTY_AFTER: Duration = Duration::from_millis(500);
/// One exchange in this many: a babbler that pauses for a millisecond hits every fourth of our frames of 0.3 ms.
const BABBLE_SHARE: u8 = 4;

/// Why no node on a bus answers, as far as the gateway can observe. The numbers are part of the register map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum BusFault {
    /// Nothing at all is received.
    Mute = 1,
    /// The line is low all the time: characters of zeros without a stop bit.
    Break = 2,
    /// A sender transmits without being asked.
    Babble = 3,
    /// The characters received are no answer.
    Garbage = 4,
    /// Our own characters do not come back as they were sent.
    Contention = 5,
    /// Our own frames do not get out whole.
    Driver = 6,
}

impl BusFault {
    /// All of them, by number, with what they mean.
    pub const ALL: [(BusFault, &str); KINDS] = [
        (BusFault::Mute, "nothing at all is received"),
        (BusFault::Break, "the line is low all the time: characters of zeros without a stop bit"),
        (BusFault::Babble, "a sender transmits without being asked"),
        (BusFault::Garbage, "the characters received are no answer"),
        (BusFault::Contention, "the gateway's own characters do not come back as they were sent"),
        (BusFault::Driver, "the gateway's own frames do not get out whole"),
    ];

    /// The name used in every text interface.
    pub const fn name(self) -> &'static str {
        match self {
            BusFault::Mute => "mute",
            BusFault::Break => "break",
            BusFault::Babble => "babble",
            BusFault::Garbage => "garbage",
            BusFault::Contention => "contention",
            BusFault::Driver => "driver",
        }
    }
}

/// How a bus as a whole is doing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BusHealth {
    /// Why no node answers; `None` if one does, or has a moment ago.
    pub fault: Option<BusFault>,
    /// Requests in vain since the last good answer of any node.
    pub in_vain: u32,
    /// How often the bus was declared faulty since reset; wraps.
    pub faults: u32,
}

const KINDS: usize = 6;

/// What follows from a request in vain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Consequence {
    /// Nothing.
    None,
    /// Only these slots can still decide whether it is the bus: ask them now.
    Ask(Bits),
    /// The bus is faulty from now on.
    Faulty,
}

/// What a bus's counters said when the last exchange ended.
#[derive(Clone, Copy, Default)]
struct Marks {
    unasked: u32,
    framing: u32,
    breaks: u32,
}

/// Watches a bus. See the module documentation.
#[derive(Default)]
pub(crate) struct Watch {
    health: BusHealth,
    /// When the first of the requests in vain ended.
    since: Instant,
    /// Slots that have been asked in vain in this round,
    failed: Bits,
    /// and what was seen then, counted by fault.
    seen: [u8; KINDS],
    rounds: u8,
    marks: Marks,
}

impl Watch {
    pub fn health(&self) -> BusHealth {
        self.health
    }

    pub fn is_faulty(&self) -> bool {
        self.health.fault.is_some()
    }

    /// Sets what was counted to zero.
    pub fn clear_counters(&mut self) {
        self.health.faults = 0;
    }

    /// The slot means something else now.
    pub fn forget(&mut self, slot: usize) {
        self.failed.set(slot, false);
    }

    /// No slot is left to be asked.
    pub fn retire(&mut self) {
        let faults = self.health.faults;
        *self = Watch { marks: self.marks, ..Watch::default() };
        self.health.faults = faults;
    }

    /// A node has answered. Returns whether this has ended a fault.
    #[inline(never)]
    pub fn answered(&mut self, counters: &BusCounters) -> bool {
        self.marks = Marks::of(counters);
        if self.health.in_vain == 0 {
            return false;
        }
        let was_faulty = self.is_faulty();
        self.retire();
        was_faulty
    }

    /// A request of `slot` has ended in vain at `at`. `living` are the slots that are not taken for dead.
    #[inline(never)]
    pub fn failed(
        &mut self,
        slot: usize,
        verdict: Verdict,
        counters: &BusCounters,
        living: Bits,
        at: Instant,
    ) -> Consequence {
        let seen = self.look(verdict, counters);
        if self.health.in_vain == 0 {
            self.since = at;
        }
        self.health.in_vain = self.health.in_vain.saturating_add(1);
        // A request that did not get out would not have done so for any other slot.
        match verdict {
            Verdict::LineBusy | Verdict::NotSent => self.failed = living,
            _ => self.failed.set(slot, true),
        }
        if let Some(count) = self.seen.get_mut((seen as usize).wrapping_sub(1)) {
            *count = count.saturating_add(1);
        }
        let others = living.without(self.failed);
        let lasts = at.since(self.since) >= FAULTY_AFTER;
        if !others.is_empty() {
            return if lasts && !self.is_faulty() { Consequence::Ask(others) } else { Consequence::None };
        }
        let fault = self.fault();
        (self.failed, self.seen) = (Bits::EMPTY, [0; KINDS]);
        self.rounds = self.rounds.saturating_add(1);
        if self.is_faulty() {
            self.health.fault = Some(fault);
        } else if self.rounds >= ROUNDS && lasts {
            self.health.fault = Some(fault);
            self.health.faults = self.health.faults.wrapping_add(1);
            return Consequence::Faulty;
        }
        Consequence::None
    }

    /// The kind of fault that this exchange alone would show.
    fn look(&mut self, verdict: Verdict, counters: &BusCounters) -> BusFault {
        let now = Marks::of(counters);
        let before = core::mem::replace(&mut self.marks, now);
        let unasked = now.unasked != before.unasked;
        let breaks = now.breaks.wrapping_sub(before.breaks);
        match verdict {
            Verdict::NotSent => BusFault::Driver,
            Verdict::Contention => BusFault::Contention,
            Verdict::LineBusy => BusFault::Babble,
            _ if unasked => BusFault::Babble,
            Verdict::NoAnswer => BusFault::Mute,
            _ if breaks > 0 && breaks == now.framing.wrapping_sub(before.framing) => BusFault::Break,
            _ => BusFault::Garbage,
        }
    }

    /// The kind of fault that this round shows.
    fn fault(&self) -> BusFault {
        let [_, broken, babble, garbage, contention, driver] = self.seen;
        let all = self.seen.iter().fold(0, |sum: u8, count| sum.saturating_add(*count));
        if babble > 0 && babble >= all / BABBLE_SHARE {
            return BusFault::Babble;
        }
        let heard = [
            (driver, BusFault::Driver),
            (contention, BusFault::Contention),
            (broken, BusFault::Break),
            (garbage, BusFault::Garbage),
        ];
        let most = heard.into_iter().max_by_key(|&(count, _)| count);
        most.filter(|&(count, _)| count > 0).map_or(BusFault::Mute, |(_, fault)| fault)
    }
}

impl Marks {
    fn of(counters: &BusCounters) -> Marks {
        Marks { unasked: counters.unasked, framing: counters.framing, breaks: counters.breaks }
    }
}

#[cfg(test)]
mod tests;
