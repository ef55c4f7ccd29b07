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
//! Beyond its bound the oldest messages are dropped, and counted. Queues that share a store are written with one commit
//! ([`tick`], [`close`]), which waits for the disk once.

use std::collections::{BTreeSet, VecDeque};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use crate::store::{Change, Lane, Message, Opened};

/// How long a message stays in memory unconfirmed.
pub const SPILL_AFTER: Duration = Duration::from_millis(400);
/// From one [`tick`] to the next; the two together are below the second that a killed program may lose.
pub const TICK: Duration = Duration::from_millis(250);
/// Messages that are read from disk at once.
const READ_AHEAD: usize = 512;
/// The most that waits in memory while the disk does not take it, of all queues of a bridge: 64 MB.
const MEMORY_MOST: u64 = 64_000_000;

/// The most that may wait, in bytes.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    disk: u64,
    memory: u64,
}

impl Bounds {
    /// The share of a queue, of this many, in what a bridge may keep on disk.
    pub fn shared(disk: u64, queues: usize) -> Bounds {
        let queues = u64::try_from(queues.max(1)).unwrap_or(u64::MAX);
        Bounds { disk: disk / queues, memory: MEMORY_MOST / queues }
    }
}

/// The queue.
pub struct Queue {
    lane: Lane,
    /// Numbers on disk.
    disk: std::ops::Range<u64>,
    disk_bytes: u64,
    most: Bounds,
    memory: VecDeque<(Instant, Message)>,
    memory_bytes: u64,
    ahead: VecDeque<(u64, Message)>,
    next: u64,
    /// Confirmed, but not yet gone: behind one that was not confirmed, or on disk.
    confirmed: BTreeSet<u64>,
    dropped: u64,
    trouble: Option<String>,
    is_being_written: bool,
}

impl Queue {
    /// A queue over a lane.
    pub fn new((lane, opened): (Lane, Opened), most: Bounds) -> Queue {
        Queue {
            lane,
            next: opened.waiting.start,
            disk: opened.waiting,
            disk_bytes: opened.bytes,
            most,
            memory: VecDeque::new(),
            memory_bytes: 0,
            ahead: VecDeque::new(),
            confirmed: BTreeSet::new(),
            dropped: 0,
            trouble: None,
            is_being_written: false,
        }
    }

    /// The number of the next message that is added.
    pub fn end(&self) -> u64 {
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
            match self.lane.read(numbers, READ_AHEAD) {
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

    /// The broker has everything below this number that was sent. Returns how many messages that is.
    pub fn confirm_below(&mut self, number: u64) -> u64 {
        let numbers = self.first()..number.min(self.next);
        let count = numbers.end.saturating_sub(numbers.start);
        self.confirmed.extend(numbers);
        self.forget_confirmed();
        count
    }

    /// Takes confirmed messages from the front of the memory, if nothing on disk is before them.
    fn forget_confirmed(&mut self) {
        while !self.is_being_written && self.disk.is_empty() && self.confirmed.remove(&self.disk.end) {
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

    /// What has waited too long goes to disk, what was confirmed is removed from it: how many, and the first that stays.
    fn due(&self, now: Instant) -> Option<Plan> {
        let is_old = |at: &Instant| now.saturating_duration_since(*at) >= SPILL_AFTER;
        let count = self.memory.iter().take_while(|(at, _)| is_old(at)).count();
        let keep_from = self.first().min(self.disk.end);
        (count > 0 || keep_from > self.disk.start).then_some(Plan { count, keep_from })
    }

    fn all(&self) -> Option<Plan> {
        Some(Plan { count: self.memory.len(), keep_from: self.first().min(self.disk.end) })
    }

    /// What is beyond the bound of the disk.
    fn excess(&self) -> Option<Plan> {
        let excess = self.disk_bytes.checked_sub(self.most.disk).filter(|excess| *excess > 0)?;
        let keep_from = self.lane.number_after(excess).ok()?.min(self.disk.end);
        Some(Plan { count: 0, keep_from })
    }

    /// Begins to write: until [`Queue::written`], the messages in memory keep their places.
    fn begin_write(&mut self, plan: &impl Fn(&Queue) -> Option<Plan>) -> Option<Write> {
        let plan = plan(self)?;
        self.is_being_written = true;
        let messages = self.memory.iter().take(plan.count).map(|(_, message)| message.clone());
        let change = Change { add: (self.disk.end..).zip(messages).collect(), keep_from: plan.keep_from };
        Some(Write { lane: self.lane.clone(), plan, change })
    }

    /// The write has ended: how many bytes are on disk, or why it failed.
    fn written(&mut self, plan: Plan, bytes: Result<u64, String>) {
        self.is_being_written = false;
        match bytes {
            Ok(bytes) => {
                self.trouble = None;
                self.changed(plan, bytes);
            }
            Err(why) => {
                self.trouble = Some(why);
                self.forget_confirmed();
            }
        }
    }

    fn changed(&mut self, plan: Plan, bytes: u64) {
        let not_confirmed = |number: &u64| !self.confirmed.contains(number);
        self.dropped += (self.disk.start..plan.keep_from).filter(not_confirmed).count() as u64;
        self.disk_bytes = bytes;
        self.disk = plan.keep_from..self.disk.end + plan.count as u64;
        for (_, message) in self.memory.drain(..plan.count) {
            self.memory_bytes -= message.size();
        }
        self.confirmed = self.confirmed.split_off(&plan.keep_from);
        if self.next < self.disk.start {
            self.next = self.disk.start;
            self.ahead.clear();
        }
        self.forget_confirmed();
    }

    /// Drops the oldest beyond the bound of the memory.
    fn bound_memory(&mut self) {
        // Only while there is nothing on disk can the oldest in memory be dropped without a hole.
        while self.memory_bytes > self.most.memory && self.disk.is_empty() {
            let Some((_, message)) = self.memory.pop_front() else { break };
            self.memory_bytes -= message.size();
            if !self.confirmed.remove(&self.disk.end) {
                self.dropped += 1;
            }
            self.disk = self.disk.end + 1..self.disk.end + 1;
            self.next = self.next.max(self.disk.end);
        }
        // With messages on disk and no way to add to them, the newest are not taken.
        while self.memory_bytes > self.most.memory {
            let Some((_, message)) = self.memory.pop_back() else { break };
            self.memory_bytes -= message.size();
            self.dropped += 1;
            self.next = self.next.min(self.end());
        }
    }
}

/// How many messages of the memory go to disk, and the first number that stays there.
#[derive(Clone, Copy, Debug)]
struct Plan {
    count: usize,
    keep_from: u64,
}

/// What of a queue is being written.
struct Write {
    lane: Lane,
    plan: Plan,
    change: Change,
}

/// A queue that can be had for a moment. It is not held while the disk writes: whoever uses it does not wait for that.
pub trait Held {
    /// Works with it.
    fn with<T>(&mut self, work: impl FnOnce(&mut Queue) -> T) -> T;
}

impl Held for &mut Queue {
    fn with<T>(&mut self, work: impl FnOnce(&mut Queue) -> T) -> T {
        work(self)
    }
}

impl Held for Arc<Mutex<Queue>> {
    fn with<T>(&mut self, work: impl FnOnce(&mut Queue) -> T) -> T {
        // A panic of another thread leaves a queue that is whole: it is changed when all is known.
        work(&mut self.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// Writes to disk what has waited too long, removes what was confirmed and what is beyond the bound. The queues are of one
/// store. Blocks until the disk has it.
pub fn tick(queues: &mut [impl Held], now: Instant) {
    commit(queues, |queue| queue.due(now));
    commit(queues, Queue::excess);
    queues.iter_mut().for_each(|queue| queue.with(Queue::bound_memory));
}

/// Everything to disk: the program ends. Queues as for [`tick`].
pub fn close(queues: &mut [impl Held]) {
    commit(queues, Queue::all);
}

fn commit(queues: &mut [impl Held], plan: impl Fn(&Queue) -> Option<Plan>) {
    let writes = queues.iter_mut().map(|queue| queue.with(|queue| queue.begin_write(&plan)));
    let writes: Vec<_> = writes.collect();
    let changes: Vec<_> = writes.iter().flatten().map(|write| (&write.lane, &write.change)).collect();
    let Some((lane, _)) = changes.first() else { return };
    let committed = lane.store().commit(&changes);
    drop(changes);
    let mut waiting = committed.as_ref().map_or(&[][..], Vec::as_slice).iter();
    for (queue, write) in queues.iter_mut().zip(writes) {
        let Some(Write { plan, .. }) = write else { continue };
        let bytes = match &committed {
            Ok(_) => Ok(waiting.next().copied().unwrap_or_default()),
            Err(why) => Err(why.clone()),
        };
        queue.with(|queue| queue.written(plan, bytes));
    }
}

#[cfg(test)]
mod tests;
