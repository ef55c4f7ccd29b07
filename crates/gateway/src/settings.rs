//! Everything the gateway is told, in one piece: what is stored, and what it starts with.

use clino_bus::{Timing, line};

use crate::config::{MAX_SLOTS, SlotConfig};

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
