//! All slots as they were at one instant, for readers that the bus level may interrupt, without a lock.
//!
//! ```text
//!  publisher ──▶ │ buffer 1 │  being written: generation n + 1
//!                │ buffer 0 │ ──▶ readers: generation n
//! ```
//!
//! The publisher writes what has changed into the buffer that is not shown, then shows it. A reader reads the buffer
//! that is shown; only if two generations are published while it reads, it has to read again. So it never gets half of
//! a number, nor two slots of different generations. Neither waits for the other: no interrupt is held off while 48
//! slots are copied.
//!
//! Limits: one publisher. 48 bytes a slot and buffer, 4.6 KB in all.

use core::sync::atomic::{AtomicU32, Ordering, fence};

use clino_bus::Instant;

use crate::bits::Bits;
use crate::config::MAX_SLOTS;
use crate::summary::Standing;
use crate::{Published, Reading, ReadingBrief, Status};

mod words;

use words::WORDS;

const BUFFERS: usize = 2;

struct Row([AtomicU32; WORDS]);

impl Row {
    fn store(&self, words: &[u32; WORDS]) {
        for (place, word) in self.0.iter().zip(words) {
            place.store(*word, Ordering::Relaxed);
        }
    }

    fn load(&self) -> [u32; WORDS] {
        self.0.each_ref().map(|word| word.load(Ordering::Relaxed))
    }
}

/// All slots as they were at one instant.
pub struct Snapshot {
    buffers: [[Row; MAX_SLOTS]; BUFFERS],
    /// The generation that is being written, or was written last.
    begun: AtomicU32,
    /// The generation that is shown.
    shown: AtomicU32,
}

impl Snapshot {
    /// Every slot is empty.
    pub const fn new() -> Snapshot {
        Snapshot {
            buffers: [const { [const { Row([const { AtomicU32::new(0) }; WORDS]) }; MAX_SLOTS] }; BUFFERS],
            begun: AtomicU32::new(0),
            shown: AtomicU32::new(0),
        }
    }

    /// The publisher. There must be one only: two would mix their generations.
    pub const fn publisher(&self) -> Publisher<'_> {
        Publisher { snapshot: self, behind: Bits::EMPTY }
    }

    /// What `look` finds in one generation. It may be called more than once; what it found in a generation that was
    /// replaced meanwhile is discarded.
    pub fn read<R>(&self, mut look: impl FnMut(&View<'_>) -> R) -> R {
        loop {
            let view = self.view();
            let found = look(&view);
            if view.holds() {
                return found;
            }
        }
    }

    /// The generation that is shown, for readers that check themselves whether it [still holds](View::holds).
    pub fn view(&self) -> View<'_> {
        let generation = self.shown.load(Ordering::Acquire);
        View { rows: self.buffer(generation), generation, begun: &self.begun }
    }

    fn buffer(&self, generation: u32) -> &[Row; MAX_SLOTS] {
        let [even, odd] = &self.buffers;
        if generation.is_multiple_of(2) { even } else { odd }
    }
}

impl Default for Snapshot {
    fn default() -> Self {
        Snapshot::new()
    }
}

/// What a slot says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Value {
    /// What the value is worth.
    pub status: Status,
    /// The angle as it is published, if it is right and fresh.
    pub angle: Option<Published>,
    /// Time since the last good value was received, in milliseconds, if there was one.
    pub age_ms: Option<u64>,
}

/// One generation, to look at.
#[derive(Clone, Copy)]
pub struct View<'a> {
    rows: &'a [Row; MAX_SLOTS],
    generation: u32,
    begun: &'a AtomicU32,
}

impl View<'_> {
    /// A slot; `None` beyond the last one.
    pub fn reading(&self, slot: usize) -> Option<Reading> {
        let number = u8::try_from(slot).ok()?;
        self.rows.get(slot).map(|row| words::reading(number, &row.load()))
    }

    /// What a slot says at `now`: a sixth of the work of [`View::reading`]. `None` beyond the last one.
    pub fn value(&self, slot: usize, now: Instant) -> Option<Value> {
        self.rows.get(slot).map(|row| words::value(&row.0, now))
    }

    /// What a slot declares at `now`. `None` beyond the last one.
    pub fn standing(&self, slot: usize, now: Instant) -> Option<Standing> {
        self.rows.get(slot).map(|row| words::standing(&row.0, now))
    }

    /// The least of a reading, as of `now`: a tenth of the work. `None` beyond the last one.
    pub fn brief(&self, slot: usize, now: Instant) -> Option<ReadingBrief> {
        self.rows.get(slot).map(|row| words::brief(&row.0, now))
    }

    /// Whether everything that was read here until now is of this generation. If not, discard what was read.
    pub fn holds(&self) -> bool {
        fence(Ordering::Acquire);
        self.begun.load(Ordering::Relaxed).wrapping_sub(self.generation) < BUFFERS as u32
    }

    /// Counts the generations; wraps.
    pub fn generation(&self) -> u32 {
        self.generation
    }
}

/// Publishes generations of a [`Snapshot`].
pub struct Publisher<'a> {
    snapshot: &'a Snapshot,
    /// Slots that the buffer to be written next has not got yet.
    behind: Bits,
}

impl Publisher<'_> {
    /// Publishes a generation in which these slots have changed.
    pub(crate) fn publish(&mut self, changed: Bits, read: impl Fn(usize) -> Option<Reading>) {
        let generation = self.snapshot.shown.load(Ordering::Relaxed).wrapping_add(1);
        self.snapshot.begun.store(generation, Ordering::Relaxed);
        fence(Ordering::Release);
        let rows = self.snapshot.buffer(generation);
        for slot in changed.or(self.behind).iter() {
            if let (Some(row), Some(reading)) = (rows.get(slot), read(slot)) {
                row.store(&words::words(&reading));
            }
        }
        self.snapshot.shown.store(generation, Ordering::Release);
        self.behind = changed;
    }
}

#[cfg(test)]
mod tests;
