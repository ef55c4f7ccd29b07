//! When an ISU has its next angle.
//!
//! A module makes a new angle every 8/15 s (AN #201 section 4) and does not say when. Its instant shows between two readings
//! that differ, to no better than the time between them; the next one is a refresh later, give or take its clock. So every
//! reading that differs narrows the span in which the next angle appears, and every refresh widens it. While it is wider
//! than [`NARROW`], a reading is put into its middle; else one at its end finds the new angle when it is hardly older than
//! that.
//!
//! A module at rest says nothing about its instant. It is read at least once in the shortest refresh then, so that no angle
//! is missed when it begins to move.
//!
//! Limits: a clock off by more than [`TOLERANCE`] keeps the span wide and is read as one at rest: nothing is missed, and
//! the angles are found up to one reading later. A module asked less often than it refreshes is not followed.

use clino_bus::Micros;

/// From one angle to the next: 8/15 s (AN #201 section 4).
pub(crate) const REFRESH: Micros = Micros(533_333);
/// How far a module's clock may be off: one in a hundred, a ceramic resonator's worst. The document gives no figure.
const TOLERANCE: Micros = Micros(REFRESH.0 / 100);
const SHORTEST: Micros = Micros(REFRESH.0 - TOLERANCE.0);
const LONGEST: Micros = Micros(REFRESH.0 + TOLERANCE.0);
/// Two exchanges of 12.5 ms: a reading in the middle of less than this would be of no use.
const NARROW: Micros = Micros(25_000);
/// Longest time between two readings while the instant is not known: a refresh less the 5 % by which the PWM output of the
/// same clock may be off, and an exchange.
const BLIND: Micros = Micros(490_000);

/// What is known of a module's next angle.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Phase {
    /// It appears after this,
    from: Micros,
    /// and at the latest then.
    by: Micros,
    /// The code read last.
    code: Option<i32>,
    /// The last angle appeared when it was expected.
    locked: bool,
}

impl Phase {
    /// A code was read with a request at `asked` whose answer ended at `at`. Returns whether it is an angle that was not
    /// read before; an angle that equals its predecessor counts as new when a refresh has certainly passed.
    pub fn read(&mut self, code: i32, asked: Micros, at: Micros) -> bool {
        let changed = self.code.replace(code) != Some(code);
        let overdue = asked >= self.by;
        if at >= self.from + SHORTEST {
            // There may have been two.
            self.begin(asked, at);
        } else if changed && at > self.from {
            let appeared_by = self.by.min(at);
            (self.from, self.by) = (self.from + SHORTEST, appeared_by + LONGEST);
            self.locked = true;
        } else if changed {
            self.begin(asked, at);
        } else if overdue {
            (self.from, self.by) = (self.from + SHORTEST, self.by + LONGEST);
            self.locked = false;
        } else {
            self.from = self.from.max(asked);
        }
        changed || overdue
    }

    /// All that is known is that this was read.
    fn begin(&mut self, asked: Micros, at: Micros) {
        (self.from, self.by, self.locked) = (asked, at + LONGEST, false);
    }

    /// When to ask after a request at `asked`, at most about `period` later; `None` if the module is not followed.
    pub fn next(&self, asked: Micros, period: Micros) -> Option<Micros> {
        if period > REFRESH || self.code.is_none() {
            return None;
        }
        let middle = self.from + Micros(self.by.since(self.from).0 / 2);
        let wide = self.by.since(self.from) > NARROW && middle > asked;
        let best = if wide { middle } else { self.by };
        let period = if self.locked { period } else { period.min(BLIND) };
        // A reading shortly before the best instant would find nothing new.
        let at_most = asked + period + Micros(period.0 / 8);
        Some(if best <= at_most { best } else { asked + period })
    }
}

#[cfg(test)]
mod tests;
