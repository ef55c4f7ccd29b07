//! What people and programs may ask of the running gateway.
//!
//! [`Order::check`] says what is wrong with an order, with the limit that it breaks; an order that passes is carried
//! out whole.

use clino_codec::t7;

use crate::config::{Bus, Kind, MAX_SLOTS, SlotConfig};
use crate::restraint::Restraint;
use crate::settings::console::ConsoleSettings;
use crate::settings::{self, BusChange, BusSettings, Number};
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
    /// These fields of a bus change, as soon as no exchange is in hand. A bit rate is refused as [`Refusal::Busy`] while a
    /// task needs the present one.
    Bus {
        /// The bus.
        bus: Bus,
        /// What changes.
        change: BusChange,
    },
    /// From now on the console behaves like this.
    Console(ConsoleSettings),
    /// A task on the T7 bus.
    T7(task::t7::Task),
    /// A task on the ISU bus.
    Isu(task::isu::Task),
    /// The task on this bus shall stop at its next consistent point.
    Cancel(Bus),
    /// All counters of slots and buses become zero.
    ClearCounters,
}

/// Why an order is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// A number is out of its range.
    Range {
        /// What was asked for.
        number: Number,
        /// Smallest allowed, in units of its last decimal.
        least: i64,
        /// Largest allowed.
        most: i64,
    },
    /// A number is less than another that it has to fit.
    Shorter {
        /// What was asked for.
        number: Number,
        /// What it may not be less than.
        least: Number,
    },
    /// No sensor of this kind has this address.
    Address {
        /// The kind; [`Kind::Off`] stands for any.
        kind: Kind,
        /// What was asked for.
        value: i64,
    },
    /// What a change names of this setting, something else in the change excludes.
    Excluded(&'static str),
    /// This is none of the line's bit rates.
    BitRate {
        /// What was asked for, bit/s.
        value: u32,
        /// What it has, bit/s.
        allowed: &'static [u32],
    },
    /// A T7 cannot be told this.
    T7(t7::EncodeError),
    /// An ISU cannot be told this.
    Isu(clino_commissioning::isu::Cause),
    /// A task under way does not leave room for it: another task, or a change of what the task works on. Ask again.
    Busy,
    /// It is right, but not done in times like these.
    Restrained(Restraint),
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
            Order::Cancel(_) | Order::ClearCounters => Ok(()),
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
