//! RS485 master for inclinometers: the half-duplex line, and one request and answer at a time.
//!
//! Everything here is sans-IO. [`Line`] takes the events of a UART (transmit register empty,
//! transmission complete, character received) and decides when the driver is on; [`Master`] turns a request
//! into a frame, the characters that come back into a typed [`ExchangeOutcome`], and silence into an error after a
//! deadline derived from the vendor's figures. Neither reads a clock: the caller passes time as [`Instant`], and
//! `poll_at` returns the next deadline.
//!
//! The same code runs in the firmware's interrupts, in host tests and on the virtual board.
#![no_std]
#![cfg_attr(docsrs, feature(doc_cfg))]
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

mod counters;
pub mod line;
mod master;
mod protocol;
mod retry;
mod serial;
mod time;
mod timing;

pub use counters::{BusCounters, DriverEnable};
pub use line::Line;
pub use master::{Blame, Engine, Event, ExchangeKind, ExchangeOutcome, Fault, Master, Prepared};
pub use protocol::{ExpectedReply, FailedCheck, Isu, Protocol, ReplyHeader, T7};
pub use retry::Retry;
pub use serial::Serial;
pub use time::{Duration, Instant, earliest};
pub use timing::Timing;

/// Its example is tested.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
