//! What the scheduler keeps about a slot: when it is due, how its tries went, whether its node is taken for dead, and which
//! sensor it is (T7) or when that has its next angle (ISU).

use clino_bus::{Duration, Instant};

use super::refresh::RefreshTracker;
use crate::config::SlotConfig;
use crate::counters::SlotCounters;
use crate::slot::{Extremes, Slot};
use crate::trace::Purpose;
use crate::value::Status;

/// A slot's turns on its bus.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Turn {
    /// When the next reading is due.
    pub due: Instant,
    /// Tries of the current reading that have failed.
    pub tried: u8,
    /// Readings in a row to which there was no answer.
    pub silent: u8,
    /// Of a node that is taken for dead: least time from its next probe to the one after that, in milliseconds. Zero of
    /// another.
    pub pause_ms: u16,
    pub sensor: Sensor,
}

/// What is kept of a sensor beside its values: another thing of each kind.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Sensor {
    /// Serial number of a T7; [`UNKNOWN`] until it has said it.
    Serial(u32),
    /// When an ISU has its next angle.
    Refresh(RefreshTracker),
}

/// No sensor has said its serial number.
const UNKNOWN: u32 = 0;

impl Default for Sensor {
    fn default() -> Sensor {
        Sensor::Serial(UNKNOWN)
    }
}

impl Sensor {
    /// What is known of the refresh of an ISU; nothing of others.
    pub fn refresh(&self) -> RefreshTracker {
        match self {
            Sensor::Refresh(tracker) => *tracker,
            Sensor::Serial(_) => RefreshTracker::default(),
        }
    }

    /// The refresh of an ISU is not known any more.
    fn lose_refresh(&mut self) {
        if let Sensor::Refresh(tracker) = self {
            *tracker = RefreshTracker::default();
        }
    }

    /// Whether a sensor of this serial number is another one than was read so far; from now on it is that.
    pub fn is_replaced_by(&mut self, serial: u32) -> bool {
        let before = core::mem::replace(self, Sensor::Serial(serial));
        matches!(before, Sensor::Serial(before) if before != UNKNOWN && before != serial)
    }
}

impl Turn {
    /// Books the next reading one period after this one was due: no drift. A reading that comes so late that
    /// the next one is due already is not made up for. Returns whether one was left out like that.
    pub fn book_next(&mut self, period: Duration, now: Instant) -> bool {
        let next = self.due + period;
        if next > now || period == Duration::ZERO {
            self.due = next.max(now);
            return false;
        }
        let skipped = self.due > Instant::ZERO;
        self.due = now + period;
        skipped
    }

    /// The sensor has other numbers now: its refresh is not known; what is known of its answers stays.
    fn restart(&mut self) {
        self.sensor.lose_refresh();
    }

    /// Whether the node is taken for dead.
    pub fn is_dead(&self) -> bool {
        self.pause_ms > 0
    }

    /// The node gets all its tries again, dead or not.
    pub fn revive(&mut self) {
        (self.silent, self.pause_ms, self.tried) = (0, 0, 0);
    }
}

/// A slot and its turns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Polled {
    pub slot: Slot,
    pub turn: Turn,
}

/// What is known of a slot besides its value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Detail {
    /// What happened to its requests.
    pub counters: SlotCounters,
    /// How the last reading that failed did; `None` if none has.
    pub last_error: Option<Status>,
    /// It does not answer, and is asked less often.
    pub is_dead: bool,
    /// A value has come that a second one has to confirm.
    pub awaits_confirmation: bool,
    /// Its lowest and its highest angle since they were cleared.
    pub extremes: Extremes,
}

impl Polled {
    pub fn new(config: SlotConfig) -> Polled {
        Polled { slot: Slot::new(config), turn: Turn::default() }
    }

    /// From now on the slot means this: nothing was read yet, and it is due at once.
    pub fn set(&mut self, config: SlotConfig) {
        self.slot.set(config);
        self.turn = Turn::default();
    }

    /// The sensor's number means something else now: what was kept of it is forgotten.
    pub fn restart(&mut self) {
        self.slot.restart();
        self.turn.restart();
    }

    /// No answer has come for long: earlier values neither confirm nor predict anything.
    pub fn lose_track(&mut self) {
        self.slot.lose_track();
        self.turn.sensor.lose_refresh();
    }

    /// When the slot is due; a retry goes first, the confirmation of a value is due `confirm_after` it came.
    pub fn due(&self, confirm_after: Duration, now: Instant) -> Instant {
        match self.slot.confirm_at(confirm_after, now) {
            _ if self.turn.tried > 0 => Instant::ZERO,
            Some(confirm_at) => confirm_at.min(self.turn.due),
            None => self.turn.due,
        }
    }

    /// Why the slot is asked now.
    pub fn purpose(&self) -> Purpose {
        match self.turn.tried {
            0 if self.turn.is_dead() => Purpose::Probe,
            0 if self.slot.is_to_confirm() => Purpose::Confirmation,
            0 => Purpose::Reading,
            _ => Purpose::Retry,
        }
    }

    /// What is known besides the value.
    pub fn detail(&self) -> Detail {
        Detail {
            counters: self.slot.counters,
            last_error: self.slot.last_error(),
            is_dead: self.turn.is_dead(),
            awaits_confirmation: self.slot.is_to_confirm(),
            extremes: self.slot.extremes(),
        }
    }
}
