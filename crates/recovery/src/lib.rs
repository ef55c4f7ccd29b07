//! Keeps an unattended gateway running: monitors its tasks, reports crashes at the next start, and starts in a degraded
//! mode after repeated crashes.
//!
//! - [`TaskMonitor`]: the [tasks](MonitoredTask) that must keep running. Each checks in within its own deadline;
//!   [`TaskMonitor::tick`] returns a task that has not. Call it before feeding the watchdog.
//! - [`Crash`]: cause, registers, place and time of a crash.
//! - [`Journal`]: data kept from one start to the next, in memory that a reset does not change. [`Journal::begin`] combines
//!   it with the reset controller's flags ([`ResetSource`]) into the [`Start`]: why the gateway has started, how often, and in
//!   which [`Mode`].
//!
//! # How it starts
//!
//! | fast crashes in a row | mode |
//! |---|---|
//! | up to 2 | [`Mode::Normal`] |
//! | 3 to 5 | [`Mode::Safe`]: the console and the Modbus port, no bus |
//! | 6 or more | [`Mode::Bare`]: the same as delivered, nothing stored is read |
//!
//! A crash is fast within [`FAST_MS`] of the start. Safe mode ends after [`SAFE_MODE_MS`]: the gateway restarts in normal
//! mode, and one more fast crash brings safe mode back. A requested restart and a power-up reset the count of fast crashes.
//!
//! A crystal that has stopped is not trusted until one of these: the gateway starts without it.
//!
//! # Limits
//!
//! No I/O and no clock: the caller provides ticks, registers and memory. Nothing here panics, and only [`TaskMonitor`] is
//! shared between contexts.
#![no_std]
#![forbid(unsafe_code)]

mod cause;
mod crash;
mod journal;
mod memory;
mod monitor;
mod start;

pub use cause::{ResetSource, StartCause};
pub use crash::{Crash, FaultStatus, PLACE, Registers};
pub use journal::Journal;
pub use memory::{Uptime, WORDS};
pub use monitor::{MonitoredTask, TICK_MS, TaskMonitor};
pub use start::{Clock, FAST_MS, Mode, SAFE_MODE_MS, Start, Uid};
