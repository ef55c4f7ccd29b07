//! The interface from the console to the gateway.

use clino_bus::DriverEnable;
use clino_bus::{BusCounters, Instant};
use clino_commissioning::TaskProgress;
use clino_gateway::order::{Order, Refusal};
use clino_gateway::settings::Named;
use clino_gateway::settings::console::ConsoleSettings;
use clino_gateway::summary::Summary;
use clino_gateway::task::TaskEvent;
use clino_gateway::trace::Entry;
use clino_gateway::{
    Alarm, AlarmDetail, Bus, BusHealth, BusSettings, Consequence, Detail, Reading, ReadingBrief, SlotConfig,
};
use clino_modbus::{Counters as PortCounters, Settings};
use clino_recovery::Start;

use crate::received::Received;

/// The gateway as the console sees it. Each call is short: one slot, one transaction, one bus.
pub trait Host {
    /// Time since reset.
    fn now(&self) -> Instant;

    /// The last reading of a slot; `None` beyond the last slot.
    fn reading(&self, slot: usize) -> Option<Reading>;

    /// The least of that, as of `now`: asked of every slot before every line of a stream.
    fn brief(&self, slot: usize, now: Instant) -> Option<ReadingBrief> {
        self.reading(slot).map(|reading| reading.brief(now))
    }

    /// All slots and faults, summed up.
    fn summary(&self) -> Summary;

    /// How a slot is set; `None` beyond the last slot.
    fn config(&self, slot: usize) -> Option<SlotConfig>;

    /// Details of a slot besides its value; `None` beyond the last slot.
    fn detail(&self, slot: usize) -> Option<Detail>;

    /// State of an alarm of a slot; `None` while it is quiet.
    fn alarm(&self, slot: usize, alarm: Alarm) -> Option<AlarmDetail>;

    /// One of the last transactions; 0 is the newest. `None` beyond the oldest that is kept.
    fn trace(&self, age: usize) -> Option<Entry>;

    /// Counters of a bus since reset, and its settings.
    fn bus(&self, bus: Bus) -> Option<BusState>;

    /// The settings of a bus alone: a tenth of the stack of all its state.
    fn bus_settings(&self, bus: Bus) -> Option<BusSettings> {
        self.bus(bus).map(|state| state.settings)
    }

    /// What a bus is about to do.
    fn bus_work(&self, bus: Bus) -> Option<BusWork>;

    /// What else an order would change.
    fn consequence(&self, order: &Order) -> Consequence;

    /// A report of a task: a finding, or its end.
    fn task_event(&mut self) -> Option<TaskEvent>;

    /// Changes the named settings of a slot, or refuses the change. Nothing else can change between looking and changing.
    fn change_slot(&mut self, slot: u8, named: Named<'_>) -> Result<(), Refusal>;

    /// Has an order carried out, or refuses it.
    fn order(&mut self, order: Order) -> Result<(), Refusal>;

    /// Waits until everything that was printed is out.
    fn flush(&mut self);

    /// The next character that was received, if there is one.
    fn received(&mut self) -> Option<Received>;

    /// Typed characters that were lost since reset: spoilt, or faster than they could be taken.
    fn lost_characters(&self) -> u32;

    /// Version of the firmware.
    fn version(&self) -> &'static str;

    /// Why, how often and how the gateway has started.
    fn start(&self) -> Start;

    /// Whether something is stored that was not taken over at this start, and that a save replaces for good.
    fn has_unread(&self) -> bool {
        false
    }

    /// Stores all settings, so that they are in force again after the next start.
    ///
    /// # Errors
    /// [`StorageError`]: what was stored before is still there.
    fn save(&mut self) -> Result<Saved, StorageError>;

    /// Discards the stored settings. The next start uses the settings as delivered.
    ///
    /// # Errors
    /// [`StorageError`]: what was stored before is still there.
    fn factory_reset(&mut self) -> Result<(), StorageError>;

    /// Restarts when all printed characters are out. Returns only in host tests.
    fn reboot(&mut self);

    /// How the console is set.
    fn console(&self) -> ConsoleSettings;

    /// How the Modbus port is set; `None` if there is none.
    fn modbus(&self) -> Option<Settings>;

    /// What happened on the Modbus port; `None` if there is none.
    fn modbus_counters(&self) -> Option<PortCounters>;

    /// Sets the Modbus port; it is valid.
    fn set_modbus(&mut self, settings: Settings);
}

/// A bus as others see it.
#[derive(Clone, Copy, Debug)]
pub struct BusState {
    /// How it is set.
    pub settings: BusSettings,
    /// What happened since reset.
    pub counters: BusCounters,
    /// Whether it is out of order.
    pub health: BusHealth,
    /// How the line driver behaved.
    pub driver: DriverEnable,
}

/// What a bus is about to do.
#[derive(Clone, Copy, Debug)]
pub struct BusWork {
    /// The settings are in force. Otherwise they will be as soon as no exchange is in hand.
    pub in_force: bool,
    /// How far the task on it is, if there is one.
    pub progress: Option<TaskProgress>,
}

/// Result of storing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Saved {
    /// Nothing: the same was stored already.
    Unchanged,
    /// It is stored now.
    Written,
}

impl Saved {
    /// The name used in every text interface.
    pub const fn name(self) -> &'static str {
        match self {
            Saved::Unchanged => "unchanged",
            Saved::Written => "written",
        }
    }
}

/// Why something cannot be stored or forgotten.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StorageError {
    /// This board stores nothing.
    Absent,
    /// Something else is being stored; ask again.
    Busy,
    /// It does not fit.
    Full,
    /// The memory did not take it.
    Failed,
}

impl StorageError {
    /// The name used in every text interface.
    pub const fn name(self) -> &'static str {
        match self {
            StorageError::Absent => "no_storage",
            StorageError::Busy => "storage_busy",
            StorageError::Full => "storage_full",
            StorageError::Failed => "storage_failed",
        }
    }
}
