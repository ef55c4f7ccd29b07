//! What a sensor sent, kept to compare it with what the gateway published.

use std::collections::VecDeque;

use crate::node::Ns;

/// One angle as the sensor put it on the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Said {
    /// First start bit of the answer, or rising edge of the pulse.
    pub at: Ns,
    /// Instant at which the sensor measured the angle.
    pub sampled_at: Ns,
    /// Axis 0, 1 or 2 of a T7; 0 for an ISU.
    pub axis: u8,
    /// The angle exactly as encoded (rounded, offset, wrapped), in µ°; rounded to 1 µ° where the code's step
    /// is no whole number of them.
    pub microdegrees: i64,
}

/// The last angles sent, oldest first, without answers that a fault damaged or withheld.
#[derive(Clone, Debug)]
pub struct Record {
    kept: VecDeque<Said>,
    capacity: usize,
    forgotten: u64,
}

/// Three axes at the highest poll rate a T7 bus reaches (about 260/s) for a minute and a half.
const DEFAULT_CAPACITY: usize = 65_536;

impl Default for Record {
    fn default() -> Self {
        Self::with_capacity(DEFAULT_CAPACITY)
    }
}

impl Record {
    /// A record that forgets its oldest entry when `capacity` is exceeded.
    #[must_use]
    pub fn with_capacity(capacity: usize) -> Self {
        Self { kept: VecDeque::new(), capacity, forgotten: 0 }
    }

    /// Entries still known, oldest first.
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = &Said> {
        self.kept.iter()
    }

    /// The newest entry.
    #[must_use]
    pub fn last(&self) -> Option<&Said> {
        self.kept.back()
    }

    /// How many entries have been dropped for want of room.
    #[must_use]
    pub fn forgotten(&self) -> u64 {
        self.forgotten
    }

    pub(crate) fn push(&mut self, said: Said) {
        if self.kept.len() >= self.capacity {
            self.kept.pop_front();
            self.forgotten += 1;
        }
        if self.capacity > 0 {
            self.kept.push_back(said);
        }
    }
}
