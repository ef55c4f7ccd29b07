//! How the bridge is: figures for Prometheus, lines for the log.

use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64, Ordering};

use crate::queue::Held;
use crate::say::say;

/// Figures of the bridge, for those who watch it.
#[derive(Debug, Default)]
pub struct BridgeHealth {
    /// Connected now.
    pub is_connected: AtomicBool,
    /// Messages that wait.
    pub waiting: AtomicU64,
    /// Messages that were dropped.
    pub dropped: AtomicU64,
    /// Messages that were confirmed.
    pub confirmed: AtomicU64,
    /// Connections that were lost.
    pub lost: AtomicU64,
    /// The disk does not take what it should.
    pub has_disk_trouble: AtomicBool,
    /// Jumps of the wall clock.
    pub clock_jumps: AtomicU64,
    /// By how much it has jumped in all, in milliseconds.
    pub clock_jumped_ms: AtomicI64,
    /// Lines that wait for InfluxDB.
    pub lines_waiting: AtomicU64,
    /// Lines that were dropped.
    pub lines_dropped: AtomicU64,
    /// InfluxDB, or the file in its place, does not take lines.
    pub has_line_trouble: AtomicBool,
}

impl BridgeHealth {
    /// Takes the figures of all queues, and says it when the disk no longer takes messages and when it does again.
    pub fn note(&self, queues: &mut [impl Held]) {
        let (mut waiting, mut dropped, mut trouble) = (0, 0, None);
        for queue in queues {
            queue.with(|queue| {
                waiting += queue.waiting();
                dropped += queue.dropped();
                trouble = trouble.take().or_else(|| queue.trouble().map(str::to_owned));
            });
        }
        self.waiting.store(waiting, Ordering::Relaxed);
        self.dropped.store(dropped, Ordering::Relaxed);
        let had_trouble = self.has_disk_trouble.swap(trouble.is_some(), Ordering::Relaxed);
        match (trouble, had_trouble) {
            (Some(why), false) => say(format_args!("store: {why}; messages wait in memory")),
            (None, true) => say("store: the disk takes messages again"),
            _ => {}
        }
    }

    /// Takes the figures of what waits for InfluxDB: lines, those dropped since the last time, and why they wait. Says it when
    /// that begins and ends.
    pub fn note_lines(&self, waiting: usize, dropped: usize, trouble: Option<&str>) {
        let number = |count: usize| u64::try_from(count).unwrap_or(u64::MAX);
        self.lines_waiting.store(number(waiting), Ordering::Relaxed);
        if dropped > 0 && self.lines_dropped.fetch_add(number(dropped), Ordering::Relaxed) == 0 {
            say("influx: more lines wait than may, the oldest are dropped");
        }
        match (trouble, self.has_line_trouble.swap(trouble.is_some(), Ordering::Relaxed)) {
            (Some(why), false) => say(format_args!("influx: {why}; {waiting} lines wait")),
            (None, true) => say("influx: lines are taken again"),
            _ => {}
        }
    }
}
