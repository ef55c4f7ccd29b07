//! Gateway core: which sensor is read when, what its last value is worth, and how that is published.
//!
//! Sans-IO. [`Gateway`] takes line events, timer captures and `now`; it hands out frames to send and
//! [`Reading`]s to publish, and says with `poll_at` when it wants to be called again.
#![no_std]
#![forbid(unsafe_code)]
// What only some of the parts need; the linker leaves it out.
#![cfg_attr(not(feature = "full"), allow(dead_code, unused_imports))]
#![cfg_attr(
    not(test),
    deny(
        clippy::arithmetic_side_effects,
        clippy::expect_used,
        clippy::indexing_slicing,
        clippy::panic,
        clippy::unwrap_used
    )
)]

#[cfg(test)]
extern crate std;

mod alarm;
mod bits;
mod bus_task;
pub mod command;
pub mod config;
mod consequence;
mod counters;
mod degraded;
mod event;
pub mod features;
mod gateway;
mod health;
pub mod lint;
pub mod order;
mod pwm;
mod refusal;
mod schedule;
pub mod settings;
mod slot;
mod stamp;
pub mod summary;
pub mod task;
pub mod trace;
mod value;

pub use alarm::{ALARMS, Alarm, AlarmDetail, AlarmState, Alarms};
pub use config::{Bus, MAX_SLOTS, PwmInput, SlotConfig, Source};
pub use consequence::Consequence;
pub use counters::SlotCounters;
pub use degraded::{DegradedMode, INTERNAL_OSCILLATOR_PPM, UART_TOLERANCE_PPM};
pub use event::{Action, Capture, QueuedEvent, Requester};
pub use gateway::Gateway;
pub use health::Health;
pub use schedule::Detail;
pub use schedule::outage::{BusFault, BusHealth};
pub use settings::{BusChange, BusSettings, Configuration, Settings};
pub use slot::{ExtremeAngle, Extremes};
pub use stamp::Stamp;
pub use value::{Published, Reading, ReadingBrief, Status};
