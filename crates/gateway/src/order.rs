//! Orders: what users and programs may change in the running gateway.
//!
//! [`Order::check`] says what is wrong with an order, with the limit that it breaks; an order that passes is carried
//! out whole.

use crate::config::{Bus, MAX_SLOTS, SlotConfig};
use crate::degraded::DegradedMode;
use crate::refusal::Number;
pub use crate::refusal::Refusal;
use crate::settings::console::ConsoleSettings;
use crate::settings::{self, BusChange, BusSettings};
use crate::task;

/// Something to be done by the bus level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// From now on the slot reads this. Its last value is forgotten.
    Slot {
        /// Number of the slot.
        slot: u8,
        /// What it reads.
        config: SlotConfig,
    },
    /// These fields of a bus change, before its next exchange. A bit rate is refused as [`Refusal::Busy`] while a
    /// task needs the present one.
    Bus {
        /// The bus.
        bus: Bus,
        /// What changes.
        change: BusChange,
    },
    /// From now on the console behaves like this.
    Console(ConsoleSettings),
    /// The alarms of this slot, or of all, are acknowledged.
    Acknowledge(Option<u8>),
    /// The lowest and the highest angle of this slot, or of all, are forgotten.
    ClearExtremes(Option<u8>),
    /// A task on the T7 bus.
    T7(task::t7::Task),
    /// A task on the ISU bus.
    Isu(task::isu::Task),
    /// The task on this bus shall stop at its next consistent point.
    Cancel(Bus),
    /// All counters of slots and buses become zero.
    ClearCounters,
}

impl Order {
    /// Whether it can be carried out.
    pub fn check(&self) -> Result<(), Refusal> {
        match self {
            Order::Slot { slot, config } => {
                slot_number(*slot)?;
                settings::slot::check(config)
            }
            Order::Bus { bus, change } => {
                settings::bus::check(*bus, &BusSettings::first(*bus).with(*bus, change))
            }
            Order::Console(console) => settings::console::check(console),
            Order::T7(task) => task::t7::Work::check(task).map_err(Refusal::T7),
            Order::Isu(task) => task::isu::Work::check(task).map_err(Refusal::Isu),
            Order::Acknowledge(slot) | Order::ClearExtremes(slot) => slot.map_or(Ok(()), slot_number),
            Order::Cancel(_) | Order::ClearCounters => Ok(()),
        }
    }

    /// Whether it may be carried out under this degraded.
    ///
    /// # Errors
    /// [`Refusal::Degraded`].
    pub(crate) fn check_in(&self, degraded: DegradedMode) -> Result<(), Refusal> {
        let refused = match degraded {
            DegradedMode::None => false,
            DegradedMode::InexactClock => self.writes(),
            DegradedMode::NoBuses => matches!(self, Order::T7(_) | Order::Isu(_)),
        };
        if refused { Err(Refusal::Degraded(degraded)) } else { Ok(()) }
    }

    /// Whether a sensor is different afterwards, also without power in between.
    const fn writes(&self) -> bool {
        match self {
            Order::T7(task) => !matches!(task, task::t7::Task::Identify(_) | task::t7::Task::Sweep(_)),
            Order::Isu(task) => !matches!(task, task::isu::Task::Identify(_) | task::isu::Task::Reset(_)),
            Order::Slot { .. }
            | Order::Bus { .. }
            | Order::Console(_)
            | Order::Acknowledge(_)
            | Order::ClearExtremes(_)
            | Order::ClearCounters
            | Order::Cancel(_) => false,
        }
    }
}

/// The last slot.
const LAST_SLOT: u8 = MAX_SLOTS.saturating_sub(1) as u8;

fn slot_number(slot: u8) -> Result<(), Refusal> {
    let (least, most) = (0, i64::from(LAST_SLOT));
    match slot <= LAST_SLOT {
        true => Ok(()),
        false => Err(Refusal::Range {
            number: Number { name: "slot", unit: "", value: slot.into(), decimals: 0 },
            least,
            most,
        }),
    }
}

#[cfg(test)]
mod tests;
