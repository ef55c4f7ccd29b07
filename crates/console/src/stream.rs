//! Readings and statistics as they come, one line at a time.

use clino_bus::Micros;
use clino_gateway::Reporter;
use clino_gateway::json::{self, Topic};
use clino_gateway::summary::Signals;

use crate::host::Host;
use crate::meter::BUSES;
use crate::reply::Reply;
use crate::{system, table};

/// From one block of statistics lines to the next.
pub const STATISTICS_EVERY: Micros = Micros::from_millis(1_000);

/// From one look at the gateway as a whole to the next: a change of its signals is printed no later.
const LOOK_EVERY: Micros = Micros::from_millis(100);

/// What is printed next.
pub struct Stream {
    reporter: Reporter,
    statistics_due: Micros,
    /// Statistics lines of this round that were printed.
    printed: usize,
    look_due: Micros,
    /// Signals of the gateway that were printed last.
    signals: Option<Signals>,
    /// Who this is was printed.
    introduced: bool,
}

impl Stream {
    /// A stream that has printed nothing yet.
    pub fn new() -> Stream {
        Stream {
            reporter: Reporter::new(),
            statistics_due: STATISTICS_EVERY,
            printed: 0,
            look_due: Micros::ZERO,
            signals: None,
            introduced: false,
        }
    }

    /// Writes the next line, if there is one; returns whether there was. People do not see statistics.
    pub fn next(&mut self, host: &dyn Host, reply: &mut Reply<'_>) -> bool {
        let now = host.now();
        if !reply.is_for_people() && !core::mem::replace(&mut self.introduced, true) {
            system::introduce(reply, host);
            return true;
        }
        if !reply.is_for_people() && now >= self.look_due {
            self.look_due = now + LOOK_EVERY;
            if self.summarise(host, reply, false) {
                return true;
            }
        }
        let next = self.reporter.next(|slot| host.glance(slot, now), now);
        if let Some(reading) = next.and_then(|slot| host.reading(slot)) {
            table::row(reply, &reading, table::name_of(host, reading.slot), now);
            return true;
        }
        if reply.is_for_people() || now < self.statistics_due {
            return false;
        }
        let mut lines = BUSES.iter().flat_map(|&bus| Topic::ALL.map(|topic| (bus, topic)));
        let next = lines.nth(self.printed);
        let Some((bus, topic)) = next else {
            self.summarise(host, reply, true);
            // While commands are typed nothing is printed: what was due meanwhile is not made up for.
            let next = self.statistics_due + STATISTICS_EVERY;
            self.statistics_due = if next > now { next } else { now + STATISTICS_EVERY };
            self.printed = 0;
            return true;
        };
        self.printed = self.printed.saturating_add(1);
        if let Some(state) = host.bus(bus) {
            _ = json::statistics(reply.out, bus, topic, &state.counters, &state.health, &state.driver);
        }
        true
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
