//! Readings and statistics as they come, one line at a time.
//!
//! Programs get a line for each reading. People get a table whose lines are written over, as long as it fits on a screen;
//! the cursor stands below it.

use clino_bus::{Duration, Instant};
use clino_gateway::summary::{Signals, count};
use clino_gateway::{Bus, MAX_SLOTS, Reading, Source};

use crate::json::{self, Topic};
use crate::reporter::Reporter;

use crate::host::Host;
use crate::reply::Reply;
use crate::{identity, table};

/// From one block of statistics lines to the next.
pub const STATISTICS_EVERY: Duration = Duration::from_millis(1_000);

/// From one look at the gateway as a whole to the next: a change of its signals is printed no later.
const LOOK_EVERY: Duration = Duration::from_millis(100);

/// Slots of the largest table that is written over: on a screen of 24 lines with its head and the command before it.
const LARGEST_TABLE: u32 = 20;

/// The line to be printed next.
pub struct Stream {
    reporter: Reporter,
    statistics_due: Instant,
    /// Statistics lines of this round that were printed.
    printed: usize,
    look_due: Instant,
    /// Signals of the gateway that were printed last.
    signals: Option<Signals>,
    /// The first line was printed.
    introduced: bool,
    /// Slots whose lines stand on a person's screen, a bit each; `None` before there is a table.
    drawn: Option<u64>,
}

impl Stream {
    /// A stream that has printed nothing yet.
    pub fn new() -> Stream {
        Stream {
            reporter: Reporter::new(),
            statistics_due: Instant::ZERO + STATISTICS_EVERY,
            printed: 0,
            look_due: Instant::ZERO,
            signals: None,
            introduced: false,
            drawn: None,
        }
    }

    /// A person begins to watch: the table is not on the screen yet.
    pub fn begin_table(&mut self) {
        self.drawn = None;
    }

    /// Writes the next line, if there is one; returns whether there was. People do not see statistics.
    pub fn next(&mut self, host: &dyn Host, reply: &mut Reply<'_>) -> bool {
        let now = host.now();
        if !reply.is_for_people() && !core::mem::replace(&mut self.introduced, true) {
            identity::introduce(reply, host);
            return true;
        }
        if !reply.is_for_people() && now >= self.look_due {
            self.look_due = now + LOOK_EVERY;
            if self.summarise(host, reply, false) {
                return true;
            }
        }
        if reply.is_for_people() && self.drawn.is_none() {
            self.draw(used(host), host, reply);
            return true;
        }
        let next = self.reporter.next(|slot| host.brief(slot, now), now);
        if let Some((report, reading)) = next.and_then(|report| Some((report, host.reading(report.slot)?))) {
            if let (Some(alarm), false) = (report.alarm, reply.is_for_people()) {
                json::alarm(reply, alarm, host.alarm(report.slot, alarm), &reading, now);
                return true;
            }
            if reply.is_for_people() {
                self.write_over(host, reply, &reading);
                return true;
            }
            row(host, reply, &reading);
            return true;
        }
        if reply.is_for_people() || now < self.statistics_due {
            return false;
        }
        let bus = self.printed.checked_div(Topic::ALL.len()).and_then(|bus| Bus::ALL.get(bus));
        let topic = self.printed.checked_rem(Topic::ALL.len()).and_then(|topic| Topic::ALL.get(topic));
        let (Some(&bus), Some(&topic)) = (bus, topic) else {
            self.summarise(host, reply, true);
            // While commands are typed nothing is printed: lines that were due meanwhile are left out.
            let next = self.statistics_due + STATISTICS_EVERY;
            self.statistics_due = if next > now { next } else { now + STATISTICS_EVERY };
            self.printed = 0;
            return true;
        };
        self.printed = self.printed.saturating_add(1);
        if let Some(state) = &host.bus(bus) {
            json::statistics(reply, bus, topic, state);
        }
        true
    }

    /// Writes the table, if it is not too large to be written over.
    #[inline(never)]
    fn draw(&mut self, used: u64, host: &dyn Host, reply: &mut Reply<'_>) {
        self.drawn = Some(used);
        if count(used) <= LARGEST_TABLE {
            (0..MAX_SLOTS)
                .filter_map(|slot| host.reading(slot))
                .for_each(|reading| row(host, reply, &reading));
        }
    }

    /// Writes a reading in its line of the table. If other slots are in use now, the table begins anew, below.
    #[inline(never)]
    fn write_over(&mut self, host: &dyn Host, reply: &mut Reply<'_>, reading: &Reading) {
        let used = used(host);
        let fits = count(used) <= LARGEST_TABLE;
        if fits && self.drawn != Some(used) {
            return self.draw(used, host, reply);
        }
        // Lines from this slot's to the cursor's.
        let up = count(used.checked_shr(reading.slot.into()).unwrap_or(0));
        if fits && up > 0 {
            reply.print("\x1b[{0}A\r\x1b[K", &[up.into()]);
        }
        row(host, reply, reading);
        if fits && up > 1 {
            reply.print("\x1b[{0}B", &[up.saturating_sub(1).into()]);
        }
    }

    /// Writes how the gateway is doing as a whole, if that has changed or is due; returns whether it has.
    #[inline(never)]
    fn summarise(&mut self, host: &dyn Host, reply: &mut Reply<'_>, due: bool) -> bool {
        let summary = host.summary();
        let changed = self.signals.replace(summary.signals) != Some(summary.signals);
        if changed || due {
            table::summary(reply, &summary);
        }
        changed || due
    }
}

fn row(host: &dyn Host, reply: &mut Reply<'_>, reading: &Reading) {
    table::row(reply, reading, table::name_of(host, reading.slot), host.now());
}

/// The slots in use, a bit each.
fn used(host: &dyn Host) -> u64 {
    let slots = (0..MAX_SLOTS)
        .filter(|&slot| host.reading(slot).is_some_and(|reading| reading.source != Source::Off));
    slots.fold(0, |used, slot| used | 1_u64.wrapping_shl(slot as u32))
}
