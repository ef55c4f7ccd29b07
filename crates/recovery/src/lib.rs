//! What keeps a gateway alive that nobody can reach: who has to be heard from how often, what a crash leaves for the next
//! start, and when to start with less.
//!
//! - [`Duties`]: everything that must go on. Each checks in within its own deadline; [`Duties::tick`] names the one that has
//!   not. Whoever feeds the watchdog asks it first.
//! - [`Crash`]: cause, registers, place and time of what went wrong.
//! - [`Journal`]: what is kept from one start to the next, in memory that a reset leaves alone. [`Journal::begin`] makes of
//!   it, and of what the reset controller says ([`Reset`]), the [`Start`]: why the gateway has started, how often, and in
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
//! A crash is fast within [`FAST_MS`] of the start. Safe mode ends by itself: after [`SAFE_MODE_MS`] the gateway tries again,
//! and one more fast crash brings it back. A start that somebody has asked for, and one after power was off, begin anew.
//!
//! A crystal that has stopped is not trusted until one of these: the gateway starts without it.
//!
//! # Limits
//!
//! No I/O and no clock: whoever uses this brings ticks, registers and memory. Nothing here panics, and nothing but
//! [`Duties`] is shared between contexts.
#![no_std]
#![forbid(unsafe_code)]

mod cause;
mod crash;
mod duty;
mod journal;
mod memory;
mod start;

pub use cause::{Cause, Reset};
pub use crash::{Crash, FaultStatus, PLACE, Registers};
pub use duty::{Duties, Duty, TICK_MS};
pub use journal::Journal;
pub use memory::{Uptime, WORDS};
pub use start::{Clock, FAST_MS, Mode, SAFE_MODE_MS, Start, Uid};
