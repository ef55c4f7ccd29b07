//! Which reading is printed next, when the console is slower than the sensors.
//!
//! A slot is printed when it has an outcome that was not printed yet and either its status changed or its
//! reporting interval has passed. Slots take turns. What is not printed in time is replaced by its successor:
//! a slow console shows fewer readings, never old ones.

use clino_bus::Micros;

use crate::config::MAX_SLOTS;
use crate::value::{Reading, Status};

#[derive(Clone, Copy, Default)]
struct Printed {
    sequence: u32,
    status: Option<Status>,
    at: Micros,
}

/// Chooses the next reading to print.
pub struct Reporter {
    printed: [Printed; MAX_SLOTS],
    turn: usize,
}

impl Reporter {
    /// A reporter that has printed nothing yet.
    pub fn new() -> Reporter {
        Reporter { printed: [Printed::default(); MAX_SLOTS], turn: 0 }
    }

    /// The reading to print now, if any; it counts as printed. `read` copies out the reading of a slot, and
    /// returns `None` from the first slot on that there is not.
    pub fn next(&mut self, read: impl Fn(usize) -> Option<Reading>, now: Micros) -> Option<Reading> {
        let turn = self.turn;
        let slots = (turn..MAX_SLOTS).chain(0..turn.min(MAX_SLOTS));
        for (reading, slot) in slots.filter_map(|slot| Some((read(slot)?, slot))) {
            let Some(printed) = self.printed.get_mut(slot) else { continue };
            if wants_printing(&reading, printed, now) {
                *printed = Printed { sequence: reading.sequence, status: Some(reading.status(now)), at: now };
                self.turn = slot.saturating_add(1);
                return Some(reading);
            }
        }
        None
    }
}

impl Default for Reporter {
    fn default() -> Self {
        Reporter::new()
    }
}

fn wants_printing(reading: &Reading, printed: &Printed, now: Micros) -> bool {
    let status = reading.status(now);
    if printed.status != Some(status) {
        return status != Status::NeverRead;
    }
    reading.sequence != printed.sequence && now >= printed.at + reading.report_every
}
