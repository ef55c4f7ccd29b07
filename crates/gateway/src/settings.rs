//! All settings of the gateway: what is stored, and what it starts with.
//!
//! They exist once, in the gateway that runs by them. [`Settings`] holds the same in one piece, for hosts with enough
//! memory.
//!
//! What can be set, its name, unit, limits and meaning stand in one table for each thing that is set: [`slot`],
//! [`bus`], [`port`], [`console`]. Console, Modbus map, stored record and the checks read these tables and state no
//! limit of their own. To add a setting: its field, its row, its register.

use clino_bus::{Timing, line};

use crate::config::{Bus, MAX_SLOTS, SlotConfig};
use console::ConsoleSettings;

pub mod bus;
pub mod console;
pub mod port;
mod setting;
pub mod slot;
#[cfg(test)]
mod tests;

pub use crate::refusal::Number;
pub use setting::{Definition, Form, Given, NO_SLOT, Named, Settable, Setting, Shown, Tabled, fingerprint};

mod change;

pub use change::BusChange;

/// How a bus runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BusSettings {
    /// Bit rate and waits.
    pub timing: Timing,
    /// The line to go with them.
    pub line: line::LineSettings,
}

impl BusSettings {
    /// A bus with these waits and a line without delays or echo.
    pub const fn new(timing: Timing) -> BusSettings {
        BusSettings { timing, line: timing.line() }
    }
}

/// A part of the settings with a fingerprint of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SettingsPart {
    /// The slot table.
    Slots,
    /// How the console behaves.
    Console,
    /// How a bus runs.
    Bus(Bus),
}

impl SettingsPart {
    /// The fingerprint of all parts.
    pub fn together(mut of: impl FnMut(SettingsPart) -> u32) -> u32 {
        let rest = of(SettingsPart::Slots) ^ of(SettingsPart::Console);
        Bus::ALL.into_iter().fold(rest, |sum, bus| sum ^ of(SettingsPart::Bus(bus)))
    }
}

/// A holder of all settings: reads and sets them one by one.
pub trait Configuration {
    /// What a slot reads; `None` beyond the last one.
    fn slot(&self, slot: usize) -> Option<&SlotConfig>;
    /// How a bus runs.
    fn bus(&self, bus: Bus) -> BusSettings;
    /// How the console behaves.
    fn console(&self) -> ConsoleSettings;
    /// From now on the slot reads this; nothing happens beyond the last one.
    fn set_slot(&mut self, slot: usize, config: &SlotConfig);
    /// From now on the bus runs like this.
    fn set_bus(&mut self, bus: Bus, settings: &BusSettings);
    /// From now on the console behaves like this.
    fn set_console(&mut self, settings: &ConsoleSettings);
}

/// The slot table, both buses, the console. 2 KB.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Settings {
    /// What each slot reads.
    pub slots: [SlotConfig; MAX_SLOTS],
    /// The T7 bus.
    pub t7: BusSettings,
    /// The ISU bus.
    pub isu: BusSettings,
    /// The console.
    pub console: ConsoleSettings,
}

impl Settings {
    /// These slots, beginning with the first, and buses without delays or echo. Entries beyond [`MAX_SLOTS`] are left
    /// out.
    pub fn new(table: &[SlotConfig], t7: Timing, isu: Timing) -> Settings {
        let mut slots = [SlotConfig::OFF; MAX_SLOTS];
        slots.iter_mut().zip(table).for_each(|(slot, config)| *slot = *config);
        Settings {
            slots,
            t7: BusSettings::new(t7),
            isu: BusSettings::new(isu),
            console: ConsoleSettings::DEFAULT,
        }
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

    fn console(&self) -> ConsoleSettings {
        self.console
    }

    fn set_console(&mut self, settings: &ConsoleSettings) {
        self.console = *settings;
    }
}
