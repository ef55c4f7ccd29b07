//! When an ISU has its next angle.
//!
//! A module makes a new angle every 8/15 s (AN #201 section 4) and does not signal it. The instant is known to lie
//! between two readings that differ; the next one is a refresh later, within the tolerance of the module's clock. So
//! every reading that differs narrows the span in which the next angle appears, and every refresh widens it. While it
//! is wider than [`NARROW`], the next reading is in its middle; else it is at its end, and finds the new angle when
//! that is little older than [`NARROW`].
//!
//! The instant of a module at rest is not known. It is read at least once in the shortest refresh then, so that no
//! angle is missed when it begins to move.
//!
//! Limits: against a clock off by more than [`TOLERANCE`], the module's or ours, the span means nothing. Every angle is
//! still read right, but up to one reading later. A module asked twice a refresh, as usual, misses none; one asked once
//! in it misses some of a fast one's, one in thirteen at 8 %. An angle of a slow one that is read again may be taken
//! for a new one that is the same. A module asked less often than it refreshes is not followed.

use clino_bus::{Duration, Instant};

use crate::stamp::Stamp;

/// From one angle to the next: 8/15 s (AN #201 section 4).
pub(crate) const REFRESH: Duration = Duration::from_micros(533_333);
/// How far a module's clock may be off: one in a hundred, a ceramic resonator's worst. The document gives no figure.
const TOLERANCE: Duration = Duration::from_micros(REFRESH.as_micros() / 100);
const SHORTEST: Duration = Duration::from_micros(REFRESH.as_micros() - TOLERANCE.as_micros());
const LONGEST: Duration = Duration::from_micros(REFRESH.as_micros() + TOLERANCE.as_micros());
/// By how much a refresh widens the span.
const WIDENS: Duration = Duration::from_micros(2 * TOLERANCE.as_micros());
/// Two exchanges of 12.5 ms: a reading in the middle of less than this would be of no use.
const NARROW: Duration = Duration::from_micros(25_000);
/// Longest time between two readings while the instant is not known: a refresh less the 5 % by which the PWM output of
/// the same clock may be off, and an exchange.
const BLIND: Duration = Duration::from_micros(490_000);

/// What is known of a module's next angle.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RefreshTracker {
    /// It appears after this,
    from: Stamp,
    /// and at most this much later, in µs; zero before an angle was read.
    width: u32,
    /// The last angle appeared when it was expected.
    locked: bool,
}

impl RefreshTracker {
    /// An angle was read with a request that was out at `asked` and whose answer ended at `at`; it `differs` from the one
    /// read before. Returns whether it was not read before; an angle that equals its predecessor counts as new when a
    /// refresh has certainly passed.
    pub fn read(&mut self, differs: bool, asked: Instant, at: Instant) -> bool {
        let changed = !self.is_known() || differs;
        let (from, width) = (self.from.near(at), Duration::from_micros(self.width));
        let (asked_after, read_after) = (asked.since(from), at.since(from));
        let overdue = asked_after >= width;
        let unexpected = read_after >= SHORTEST || changed && read_after == Duration::ZERO;
        let (from, width, locked) = if !self.is_known() || unexpected {
            // Two refreshes may have passed, or one came at an unexpected time: only this reading is certain.
            (asked, at.since(asked) + LONGEST, false)
        } else if changed {
            (from + SHORTEST, width.min(read_after) + WIDENS, true)
        } else if overdue {
            (from + SHORTEST, width + WIDENS, false)
        } else {
            (from.max(asked), width - asked_after, self.locked)
        };
        *self = RefreshTracker { from: Stamp::of(from), width: width.as_micros(), locked };
        changed || overdue
    }

    /// Whether an angle was read.
    const fn is_known(&self) -> bool {
        self.width > 0
    }

    /// When to ask after a request at `asked`, at most about `period` later; `None` if the module is not followed.
    pub fn next(&self, asked: Instant, period: Duration) -> Option<Instant> {
        if period > REFRESH || !self.is_known() {
            return None;
        }
        let (from, width) = (self.from.near(asked), Duration::from_micros(self.width));
        let middle = from + Duration::from_micros(self.width / 2);
        let is_wide = width > NARROW && middle > asked;
        let best = if is_wide { middle } else { from + width };
        let period = if self.locked { period } else { period.min(BLIND) };
        // A reading shortly before the best instant would find nothing new.
        let at_most = asked + period + Duration::from_micros(period.as_micros() / 8);
        Some(if best <= at_most { best } else { asked + period })
    }
}

#[cfg(test)]
mod tests;
