//! What the console needs of the rest of the gateway.

use clino_bus::{Counters, Micros, Timing, line};
use clino_commissioning::Progress;
use clino_gateway::json::DriverEnable;
use clino_gateway::order::{Order, Refusal};
use clino_gateway::task::News;
use clino_gateway::{Bus, Reading};

/// The gateway as the console sees it.
pub trait Host {
    /// Time since reset.
    fn now(&self) -> Micros;

    /// The last reading of a slot; `None` beyond the last slot.
    fn reading(&self, slot: usize) -> Option<Reading>;

    /// What happened on a bus since reset, and how it is set.
    fn bus(&self, bus: Bus) -> Option<BusState>;

    /// What a task has found, or how it ended.
    fn news(&mut self) -> Option<News>;

    /// Hands an order to the bus level.
    fn order(&mut self, order: Order) -> Result<(), Refusal>;

    /// Typed characters that were lost since reset: spoilt, or faster than they could be taken.
    fn lost_characters(&self) -> u32;

    /// Version of the firmware.
    fn version(&self) -> &'static str;
}

/// A bus as others see it.
#[derive(Clone, Copy, Debug)]
pub struct BusState {
    /// Bit rate and waits.
    pub timing: Timing,
    /// Its line.
    pub line: line::Settings,
    /// What happened since reset.
    pub counters: Counters,
    /// How the line driver behaved.
    pub driver: DriverEnable,
    /// How far the task on it is, if there is one.
    pub progress: Option<Progress>,
}
