//! Gateway core: which sensor is read when, what its last value is worth, and how that is told.
//!
//! Sans-IO. [`Gateway`] takes line events, timer captures and `now`; it hands out frames to send and
//! [`Reading`]s to publish, and says with `poll_at` when it wants to be called again. [`Reporter`] chooses
//! which reading is printed next; [`json`] prints it.
#![no_std]
#![forbid(unsafe_code)]
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

pub mod config;
mod gateway;
pub mod json;
pub mod order;
mod polling;
mod reporter;
mod slot;
pub mod task;
mod traffic;
mod value;

pub use config::{Bus, MAX_SLOTS, PwmInput, SlotConfig, Source};
pub use gateway::{Action, Capture, Gateway};
pub use reporter::Reporter;
pub use value::{Reading, Status};
