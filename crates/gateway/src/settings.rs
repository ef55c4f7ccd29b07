//! Everything the gateway is told: what is stored, and what it starts with.
//!
//! It exists once, in the gateway that runs by it. [`Settings`] is the same in one piece, for those who have the room.

use clino_bus::{Timing, line};

use crate::config::{Bus, MAX_SLOTS, SlotConfig};

mod change;

pub use change::BusChange;

/// How a bus runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BusSettings {
    /// Bit rate and waits.
    pub timing: Timing,
    /// The line to go with them.
    pub line: line::Settings,
}

impl BusSettings {
    /// A bus with these waits and a line without delays or echo.
    pub const fn new(timing: Timing) -> BusSettings {
        BusSettings { timing, line: timing.line() }
    }
}

/// Who has all settings, and tells or takes them one by one.
pub trait Configuration {
    /// What a slot reads; `None` beyond the last one.
    fn slot(&self, slot: usize) -> Option<&SlotConfig>;
    /// How a bus runs.
    fn bus(&self, bus: Bus) -> BusSettings;
    /// From now on the slot reads this; nothing happens beyond the last one.
    fn set_slot(&mut self, slot: usize, config: &SlotConfig);
    /// From now on the bus runs like this.
    fn set_bus(&mut self, bus: Bus, settings: &BusSettings);
}

/// The slot table and both buses. 2 KB.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Settings {
    /// What each slot reads.
    pub slots: [SlotConfig; MAX_SLOTS],
    /// The T7 bus.
    pub t7: BusSettings,
    /// The ISU bus.
    pub isu: BusSettings,
}

impl Settings {
    /// These slots, beginning with the first, and buses without delays or echo. Entries beyond [`MAX_SLOTS`] are left out.
    pub fn new(table: &[SlotConfig], t7: Timing, isu: Timing) -> Settings {
        let mut slots = [SlotConfig::OFF; MAX_SLOTS];
        slots.iter_mut().zip(table).for_each(|(slot, config)| *slot = *config);
        Settings { slots, t7: BusSettings::new(t7), isu: BusSettings::new(isu) }
    }
}

impl Configuration for Settings {
    fn slot(&self, slot: usize) -> Option<&SlotConfig> {
        self.slots.get(slot)
    }

    fn bus(&self, bus: Bus) -> BusSettings {
        match bus {
            Bus::T7 => self.t7,
            Bus::Isu => self.isu,
        }
    }

    fn set_slot(&mut self, slot: usize, config: &SlotConfig) {
        if let Some(place) = self.slots.get_mut(slot) {
            *place = *config;
        }
    }

    fn set_bus(&mut self, bus: Bus, settings: &BusSettings) {
        match bus {
            Bus::T7 => self.t7 = *settings,
            Bus::Isu => self.isu = *settings,
        }
    }
}
