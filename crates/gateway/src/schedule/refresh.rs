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
    /// and at most this much later, in µs.
    width: u32,
    /// The angle read last, in µ°.
    code: i32,
    /// An angle was read, not long ago.
    known: bool,
    /// The last angle appeared when it was expected.
    locked: bool,
}

impl RefreshTracker {
    /// An angle was read with a request that was out at `asked` and whose answer ended at `at`. Returns whether it was
    /// not read before; an angle that equals its predecessor counts as new when a refresh has certainly passed.
    pub fn read(&mut self, code: i32, asked: Instant, at: Instant) -> bool {
        let changed = !self.known || code != self.code;
        let (from, by) = self.bounds(at);
        let overdue = asked >= by;
        let (from, by, locked) = if !self.known || at >= from + SHORTEST || changed && at <= from {
            // Two refreshes may have passed, or one came at an unexpected time: only this reading is certain.
            (asked, at + LONGEST, false)
        } else if changed {
            (from + SHORTEST, by.min(at) + LONGEST, true)
        } else if overdue {
            (from + SHORTEST, by + LONGEST, false)
        } else {
            (from.max(asked), by, self.locked)
        };
        *self = RefreshTracker {
            from: Stamp::of(from),
            width: by.since(from).as_micros(),
            code,
            known: true,
            locked,
        };
        changed || overdue
    }

    /// After when, and by when, the next angle appears.
    fn bounds(&self, now: Instant) -> (Instant, Instant) {
        let from = self.from.near(now);
        (from, from + Duration::from_micros(self.width))
    }

    /// When to ask after a request at `asked`, at most about `period` later; `None` if the module is not followed.
    pub fn next(&self, asked: Instant, period: Duration) -> Option<Instant> {
        if period > REFRESH || !self.known {
            return None;
        }
        let (from, by) = self.bounds(asked);
        let middle = from + Duration::from_micros(self.width / 2);
        let is_wide = by.since(from) > NARROW && middle > asked;
        let best = if is_wide { middle } else { by };
        let period = if self.locked { period } else { period.min(BLIND) };
        // A reading shortly before the best instant would find nothing new.
        let at_most = asked + period + Duration::from_micros(period.as_micros() / 8);
        Some(if best <= at_most { best } else { asked + period })
    }
}

#[cfg(test)]
mod tests;
