//! Resets of the whole chip: their source, the reset controller's flags, and how the machine executes them.

use std::sync::Mutex;

use rsemu::core::sync::{AtomicBool, Ordering};
use rsemu::core::wire::{Level, WireId, WireSink};

use super::Cpu;
use super::work::Work;
use crate::incident::{Event, ResetCause};
use crate::timeline::lock;

/// Ports that tell the reset controller the cause of a reset.
pub(super) const FLAGS: [&str; 3] = ["sysresetreq", "brownout", "nrst"];

/// The port of a cause; the watchdog has a line of its own.
const fn flag(cause: ResetCause) -> &'static str {
    match cause {
        ResetCause::Watchdog => "",
        ResetCause::Software => FLAGS[0],
        ResetCause::BrownOut => FLAGS[1],
        ResetCause::Pin => FLAGS[2],
    }
}

/// The line that resets the whole chip: the watchdog's.
#[derive(Default)]
pub(super) struct ResetLine {
    pub asserted: AtomicBool,
    /// Why, if it is not the watchdog.
    pub cause: Mutex<Option<ResetCause>>,
}

impl WireSink for ResetLine {
    fn set_level(&self, _src: WireId, _line: u32, level: Level) {
        if level.is_high() {
            self.asserted.store(true, Ordering::Relaxed);
        }
    }
}

impl Cpu {
    /// The whole chip is to be reset, for another cause than the watchdog.
    pub(super) fn reset_from(&self, cause: ResetCause) {
        if let Some(line) = lock(&self.flags).get(flag(cause)) {
            line.pulse(Level::High);
        }
        *lock(&self.reset_line.cause) = Some(cause);
        self.reset_line.asserted.store(true, Ordering::Relaxed);
    }

    /// Asks the machine for the reset that the watchdog, firmware or a scenario wants; returns whether one does.
    pub(super) fn hands_on_reset(&self, work: &mut Work, at: u64) -> bool {
        if self.core.reset_requested() {
            self.core.clear_reset_request();
            self.reset_from(ResetCause::Software);
        }
        if !self.reset_line.asserted.swap(false, Ordering::Relaxed) {
            return false;
        }
        work.stats.resets += 1;
        let now = self.timeline.ns_at(at);
        // Only the watchdog's line asks for a reset without a cause.
        let cause = lock(&self.reset_line.cause).take().unwrap_or(ResetCause::Watchdog);
        self.chronicle.note(now, Event::Reset(cause));
        work.planting.reset(now);
        work.locked_up = false;
        for actor in &work.actors {
            actor.resetting();
        }
        if let Some(reset) = self.machine_reset.get() {
            reset.request();
        }
        true
    }
}
