//! When an ISU measures, and in which units it speaks.
//!
//! A new angle every 8/15 s (section 4); 360/65536 ° a unit, relative to the null position (sections 3 and
//! 6); nine ASCII characters a line (section 4, "ASCII Output Mode").

use crate::motion;
use crate::node::Ns;

/// Fifteen refresh periods, in ns.
const FIFTEEN_PERIODS: u64 = 8_000_000_000;

/// One refresh period, rounded down to a whole nanosecond.
pub const REFRESH: Ns = FIFTEEN_PERIODS / 15;

/// Instants at which a module measures: at `origin`, at `origin + phase`, and every 8/15 s after that.
#[derive(Clone, Copy, Debug)]
pub(super) struct Schedule {
    pub origin: Ns,
    pub phase: Ns,
}

impl Schedule {
    /// The `k`th instant after `origin + phase`, without adding up the fraction of a nanosecond.
    fn instant(self, k: u64) -> Ns {
        self.origin + self.phase + k * FIFTEEN_PERIODS / 15
    }

    /// How many instants from `origin + phase` on have been reached at `now`.
    fn reached(self, now: Ns) -> u64 {
        // floor(k · 8e9 / 15) ≤ t  ⇔  k ≤ (15 t + 14) / 8e9
        now.checked_sub(self.origin + self.phase).map_or(0, |t| (15 * t + 14) / FIFTEEN_PERIODS + 1)
    }

    /// The last instant not after `now`, which is not before `origin`.
    pub fn latest(self, now: Ns) -> Ns {
        self.reached(now).checked_sub(1).map_or(self.origin, |k| self.instant(k))
    }

    /// The first instant after `now`.
    pub fn next_after(self, now: Ns) -> Ns {
        self.instant(self.reached(now))
    }
}

/// An angle in 360/65536 °, rounded to nearest, a full turn being 0 again.
pub(super) fn from_microdegrees(angle: i64) -> u16 {
    let turn = motion::TURN;
    (((motion::unidirectional(angle) << 16) + turn / 2) / turn) as u16
}

/// An angle in 360/65536 ° as 0 … 360° in µ°, rounded to nearest.
pub(super) fn to_microdegrees(angle: u16) -> i64 {
    (i64::from(angle) * motion::TURN + (1 << 15)) >> 16
}

/// An angle in 360/65536 ° as −180.00 … +179.99° in 0.01°, rounded to nearest, halves away from zero.
pub(super) fn to_centidegrees(angle: u16) -> i64 {
    let scaled = i64::from(angle.cast_signed()) * 36_000;
    (scaled + scaled.signum() * (1 << 15)) / (1 << 16)
}

/// One line of the ASCII mode, the number padded with blanks to six characters.
pub(super) fn ascii_line(centidegrees: i64) -> Vec<u8> {
    let sign = if centidegrees < 0 { '-' } else { '+' };
    let (whole, hundredths) = (centidegrees.abs() / 100, centidegrees.abs() % 100);
    format!("{sign}{whole:3}.{hundredths:02}\r\n").into_bytes()
}
