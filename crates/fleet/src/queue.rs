//! What waits for the broker: first in memory, on disk when the broker has not confirmed it within [`SPILL_AFTER`].
//!
//! ```text
//!   first ─────────── on disk ──────────▶ end of the disk ──── in memory ────▶ end
//!            ▲ next to be sent: behind everything that was sent on this connection
//! ```
//!
//! Messages are numbered in the order in which they came, and are sent in this order. After a connection is lost, sending
//! begins anew at the first that was not confirmed: a message may come twice, none is left out. While the broker confirms
//! quickly, nothing is written to disk. A program that is killed loses what is in memory: at most [`SPILL_AFTER`] and a tick.
//!
//! Beyond its bound the oldest messages are dropped, and counted.

use std::collections::{BTreeSet, VecDeque};
use std::time::{Duration, Instant};

use crate::store::{Change, Message, Opened, Store};

/// How long a message stays in memory unconfirmed.
pub const SPILL_AFTER: Duration = Duration::from_millis(400);
/// From one [`Queue::tick`] to the next; the two together are below the second that a killed program may lose.
pub const TICK: Duration = Duration::from_millis(250);
/// Messages that are read from disk at once.
const READ_AHEAD: usize = 512;
/// The most that waits in memory while the disk does not take it: 64 MB.
const MEMORY_MOST: u64 = 64_000_000;

/// The queue.
pub struct Queue {
    store: Option<Store>,
    /// Numbers on disk.
    disk: std::ops::Range<u64>,
    disk_bytes: u64,
    most_bytes: u64,
    memory: VecDeque<(Instant, Message)>,
    memory_bytes: u64,
    ahead: VecDeque<(u64, Message)>,
    next: u64,
    /// Confirmed, but not yet gone: behind one that was not confirmed, or on disk.
    confirmed: BTreeSet<u64>,
    dropped: u64,
    trouble: Option<String>,
}

impl Queue {
    /// A queue over a store, or in memory alone.
    pub fn new(store: Option<(Store, Opened)>, most_bytes: u64) -> Queue {
        let (store, waiting, disk_bytes) = match store {
            Some((store, opened)) => (Some(store), opened.waiting, opened.bytes),
            None => (None, 0..0, 0),
        };
        Queue {
            store,
            next: waiting.start,
            disk: waiting,
            disk_bytes,
            most_bytes,
            memory: VecDeque::new(),
            memory_bytes: 0,
            ahead: VecDeque::new(),
            confirmed: BTreeSet::new(),
            dropped: 0,
            trouble: None,
        }
    }

    fn end(&self) -> u64 {
        self.disk.end + self.memory.len() as u64
    }

    /// The first that is not confirmed.
    fn first(&self) -> u64 {
        let mut first = self.disk.start;
        for number in self.confirmed.range(first..) {
            if *number != first {
                break;
            }
            first += 1;
        }
        first
    }

    /// Adds a message.
    pub fn push(&mut self, message: Message, now: Instant) {
        self.memory_bytes += message.size();
        self.memory.push_back((now, message));
    }

    /// The next message to be sent on this connection, and its number.
    pub fn send_next(&mut self) -> Option<(u64, Message)> {
        while self.confirmed.contains(&self.next) {
            self.next += 1;
        }
        if self.next < self.disk.end {
            return self.next_from_disk();
        }
        let index = usize::try_from(self.next - self.disk.end).ok()?;
        let message = self.memory.get(index)?.1.clone();
        self.next += 1;
        Some((self.next - 1, message))
    }

    fn next_from_disk(&mut self) -> Option<(u64, Message)> {
        if self.ahead.front().is_none_or(|(number, _)| *number != self.next) {
            let numbers = self.next..self.disk.end;
            match self.store.as_ref()?.read(numbers, READ_AHEAD) {
                Ok(found) => self.ahead = found.into(),
                Err(why) => {
                    self.trouble = Some(why);
                    return None;
                }
            }
            if self.ahead.is_empty() {
                // Numbers that are not there any more: nothing of them is left to be sent.
                self.confirmed.extend(self.next..self.disk.end);
                self.next = self.disk.end;
                return self.send_next();
            }
        }
        let (number, message) = self.ahead.pop_front()?;
        // Between them are messages that could not be read.
        self.confirmed.extend(self.next..number);
        self.next = number + 1;
        Some((number, message))
    }

    /// The broker has confirmed a message.
    pub fn confirm(&mut self, number: u64) {
        if (self.disk.start..self.end()).contains(&number) {
            self.confirmed.insert(number);
        }
        self.forget_confirmed();
    }

    /// Takes confirmed messages from the front of the memory, if nothing on disk is before them.
    fn forget_confirmed(&mut self) {
        while self.disk.is_empty() && self.confirmed.remove(&self.disk.end) {
            let Some((_, message)) = self.memory.pop_front() else { break };
            self.memory_bytes -= message.size();
            self.disk = self.disk.end + 1..self.disk.end + 1;
            self.next = self.next.max(self.disk.end);
        }
    }

    /// The connection was lost: what was sent and not confirmed is sent again.
    pub fn rewind(&mut self) {
        self.next = self.first();
        self.ahead.clear();
    }

    /// Messages that wait.
    pub fn waiting(&self) -> u64 {
        (self.end() - self.disk.start).saturating_sub(self.confirmed.len() as u64)
    }

    /// Messages that were dropped since this program began.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Why the disk does not take what it should.
    pub fn trouble(&self) -> Option<&str> {
        self.trouble.as_deref()
    }

    /// Writes to disk what has waited too long, and removes what was confirmed. Blocks until the disk has it.
    pub fn tick(&mut self, now: Instant) {
        let old = self
            .memory
            .iter()
            .take_while(|(at, _)| now.saturating_duration_since(*at) >= SPILL_AFTER)
            .count();
        let keep_from = self.first().min(self.disk.end);
        if old > 0 || keep_from > self.disk.start {
            self.spill(old, keep_from);
        }
        self.bound();
    }

    /// Everything to disk: the program ends.
    pub fn close(&mut self) {
        let keep_from = self.first().min(self.disk.end);
        self.spill(self.memory.len(), keep_from);
    }

    fn spill(&mut self, count: usize, keep_from: u64) {
        let Some(store) = &self.store else { return };
        let add: Vec<_> =
            (self.disk.end..).zip(self.memory.iter().take(count).map(|(_, message)| message)).collect();
        match store.commit(&Change { add: &add, keep_from }) {
            Ok(bytes) => {
                self.trouble = None;
                self.disk_bytes = bytes;
                self.disk = keep_from..self.disk.end + count as u64;
                for (_, message) in self.memory.drain(..count) {
                    self.memory_bytes -= message.size();
                }
                self.confirmed = self.confirmed.split_off(&keep_from);
                self.forget_confirmed();
            }
            Err(why) => self.trouble = Some(why),
        }
    }

    /// Drops the oldest beyond the bounds.
    fn bound(&mut self) {
        if self.disk_bytes > self.most_bytes
            && let Some(store) = &self.store
            && let Ok(keep_from) = store.number_after(self.disk_bytes - self.most_bytes)
        {
            let gone =
                (self.disk.start..keep_from).filter(|number| !self.confirmed.contains(number)).count() as u64;
            self.spill(0, keep_from.min(self.disk.end));
            self.dropped += gone;
            self.next = self.next.max(self.disk.start);
            self.ahead.clear();
        }
        let most = if self.store.is_some() { MEMORY_MOST } else { self.most_bytes.min(MEMORY_MOST) };
        // Only while there is nothing on disk can the oldest in memory be dropped without a hole.
        while self.memory_bytes > most && self.disk.is_empty() {
            let Some((_, message)) = self.memory.pop_front() else { break };
            self.memory_bytes -= message.size();
            if !self.confirmed.remove(&self.disk.end) {
                self.dropped += 1;
            }
            self.disk = self.disk.end + 1..self.disk.end + 1;
            self.next = self.next.max(self.disk.end);
        }
        // With messages on disk and no way to add to them, the newest are not taken.
        while self.memory_bytes > most {
            let Some((_, message)) = self.memory.pop_back() else { break };
            self.memory_bytes -= message.size();
            self.dropped += 1;
            self.next = self.next.min(self.end());
        }
    }
}

#[cfg(test)]
mod tests;
