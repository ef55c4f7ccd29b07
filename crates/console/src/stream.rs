//! Readings and statistics as they come, one line at a time.

use core::fmt::{self, Write};

use clino_bus::Micros;
use clino_gateway::json::{self, Topic};
use clino_gateway::{Bus, Reporter, Source};

use crate::host::Host;
use crate::shell::Audience;
use crate::table;

/// From one block of statistics lines to the next.
pub const STATISTICS_EVERY: Micros = Micros::from_millis(1_000);

const BUSES: [Bus; 2] = [Bus::T7, Bus::Isu];

/// What is printed next.
pub struct Stream {
    reporter: Reporter,
    statistics_due: Micros,
    /// Statistics lines of this round that were printed.
    printed: usize,
}

impl Stream {
    /// A stream that has printed nothing yet.
    pub fn new() -> Stream {
        Stream { reporter: Reporter::new(), statistics_due: STATISTICS_EVERY, printed: 0 }
    }

    /// Writes the next line, if there is one. People do not see statistics.
    pub fn next(
        &mut self,
        host: &impl Host,
        audience: Audience,
        out: &mut dyn Write,
    ) -> Result<bool, fmt::Error> {
        let now = host.now();
        let read = |slot| host.reading(slot);
        if let Some(reading) = self.reporter.next(read, now) {
            match audience {
                _ if reading.source == Source::Off => {}
                Audience::People => table::row(out, &reading, now)?,
                Audience::Programs => json::reading(out, &reading, now)?,
            }
            return Ok(true);
        }
        if audience == Audience::People || now < self.statistics_due {
            return Ok(false);
        }
        let mut lines = BUSES.iter().flat_map(|&bus| Topic::ALL.map(|topic| (bus, topic)));
        let next = lines.nth(self.printed);
        let Some((bus, topic)) = next else {
            self.statistics_due = self.statistics_due + STATISTICS_EVERY;
            self.printed = 0;
            return Ok(false);
        };
        self.printed = self.printed.saturating_add(1);
        if let Some(state) = host.bus(bus) {
            json::statistics(out, bus, topic, &state.counters, &state.driver)?;
        }
        Ok(true)
    }
}
