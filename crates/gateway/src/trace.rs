//! The last transactions of both buses: what happened before a fault.
//!
//! Written where a transaction ends; read newest first. 12 bytes an entry.

use clino_bus::{Duration, Fault, Instant};
use clino_codec::checks::Check;
use heapless::Vec;

use crate::{Bus, Stamp};

/// How many transactions are kept.
pub const TRACED: usize = 32;

/// How a transaction ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Verdict {
    /// A good answer.
    Good,
    /// Nothing came in time.
    NoAnswer,
    /// Characters, but no frame.
    Garbled,
    /// The receiver flagged a character as wrong.
    LineErrors,
    /// Wrong checksum.
    Checksum,
    /// Wrong length.
    Length,
    /// Another address or command.
    Foreign,
    /// A value out of its range.
    Value,
    /// Another sender transmitted during the request.
    Contention,
    /// The line did not fall silent.
    LineBusy,
    /// The request did not get out.
    NotSent,
    /// The window of a search is over.
    Over,
}

impl Verdict {
    /// The name used in every text interface.
    pub const fn name(self) -> &'static str {
        match self {
            Verdict::Good => "good",
            Verdict::NoAnswer => "no_answer",
            Verdict::Garbled => "garbled",
            Verdict::LineErrors => "line_errors",
            Verdict::Checksum => "checksum",
            Verdict::Length => "length",
            Verdict::Foreign => "foreign",
            Verdict::Value => "value",
            Verdict::Contention => "contention",
            Verdict::LineBusy => "line_busy",
            Verdict::NotSent => "not_sent",
            Verdict::Over => "over",
        }
    }

    pub(crate) fn of_fault(fault: &Fault<Check>) -> Verdict {
        match fault {
            Fault::NoAnswer { .. } => Verdict::NoAnswer,
            Fault::Garbled { .. } => Verdict::Garbled,
            Fault::Bad(check) => match check {
                Check::LineErrors => Verdict::LineErrors,
                Check::Checksum => Verdict::Checksum,
                Check::Length => Verdict::Length,
                Check::Address | Check::Command => Verdict::Foreign,
                Check::Value => Verdict::Value,
            },
            Fault::Contention => Verdict::Contention,
            Fault::LineBusy => Verdict::LineBusy,
            Fault::NotSent => Verdict::NotSent,
            Fault::Over { .. } => Verdict::Over,
        }
    }
}

/// Why a request was sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Purpose {
    /// A reading that was due.
    Reading,
    /// A repetition of one that failed.
    Retry,
    /// A second reading to confirm the first.
    Confirmation,
    /// To see whether a dead node is back.
    Probe,
    /// A step of a commissioning task.
    Task,
}

impl Purpose {
    /// The name used in every text interface.
    pub const fn name(self) -> &'static str {
        match self {
            Purpose::Reading => "reading",
            Purpose::Retry => "retry",
            Purpose::Confirmation => "confirmation",
            Purpose::Probe => "probe",
            Purpose::Task => "task",
        }
    }
}

/// One transaction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Entry {
    at: Stamp,
    /// From then to the end of the transaction, in microseconds; at most 65 535 steps of 16 µs, a second.
    took: u16,
    /// The address that was asked, in 7 bits, and the number of its bus.
    node: u8,
    /// The command code (T7) or function (ISU).
    pub command: u8,
    /// Why.
    pub purpose: Purpose,
    /// How it ended.
    pub verdict: Verdict,
}

/// Microseconds of a count of [`Entry::took`].
const TOOK_STEP_US: u32 = 16;

/// Where an entry's node has the number of its bus: no address is greater than 127.
const BUS_BIT: u32 = 7;

impl Entry {
    /// Nothing has ended yet.
    pub(crate) fn begun(at: Instant, bus: Bus, (address, command): (u8, u8), purpose: Purpose) -> Entry {
        let node = address & !(1 << BUS_BIT) | (bus as u8) << BUS_BIT;
        Entry { at: Stamp::of(at), took: 0, node, command, purpose, verdict: Verdict::NotSent }
    }

    pub(crate) fn ended(self, at: Instant, verdict: Verdict) -> Entry {
        const STEP: u64 = TOOK_STEP_US as u64;
        let took = u16::try_from(self.at.micros_ago(at) / STEP).unwrap_or(u16::MAX);
        Entry { took, verdict, ..self }
    }

    /// When the request was handed to the line, as seen at `now`.
    pub fn at(&self, now: Instant) -> Instant {
        self.at.near(now)
    }

    /// Where.
    pub fn bus(&self) -> Bus {
        if self.node >> BUS_BIT == Bus::Isu as u8 { Bus::Isu } else { Bus::T7 }
    }

    /// The address that was asked.
    pub fn address(&self) -> u8 {
        self.node & !(1 << BUS_BIT)
    }

    /// How long it took, to 16 µs; a second at most.
    pub fn took(&self) -> Duration {
        Duration::from_micros(TOOK_STEP_US).times(self.took.into())
    }
}

/// The last [`TRACED`] transactions.
#[derive(Clone, Debug)]
pub struct Trace {
    entries: Vec<Entry, TRACED>,
    /// Where the next one goes.
    next: usize,
    total: u32,
}

impl Trace {
    /// Nothing has happened yet.
    pub const fn new() -> Trace {
        Trace { entries: Vec::new(), next: 0, total: 0 }
    }

    pub(crate) fn push(&mut self, entry: Entry) {
        match self.entries.get_mut(self.next) {
            Some(place) => *place = entry,
            // Until there are as many, the next one goes behind the last.
            None => _ = self.entries.push(entry),
        }
        self.next = self.next.wrapping_add(1) % TRACED;
        self.total = self.total.wrapping_add(1);
    }

    /// How many transactions there were since reset; wraps.
    pub const fn total(&self) -> u32 {
        self.total
    }

    /// The transactions, newest first.
    pub fn iter(&self) -> impl Iterator<Item = &Entry> {
        let (after, before) = self.entries.split_at_checked(self.next).unwrap_or((&[], &self.entries));
        after.iter().rev().chain(before.iter().rev())
    }
}

impl Default for Trace {
    fn default() -> Self {
        Trace::new()
    }
}
