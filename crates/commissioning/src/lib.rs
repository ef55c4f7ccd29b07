//! Commissioning of inclinometers: find them on a line, set them up, repair them.
//!
//! Each task is an [`Operation`]: a resumable state machine that returns its next step (an exchange, a pause, another
//! bit rate) and takes the outcome. It neither sends nor reads a clock. A [`Runner`] runs it on a
//! [`Master`](clino_bus::Master), one step at a time, so that a gateway can go on polling between the steps.
//!
//! | sensor | operations |
//! |---|---|
//! | [T7](t7) | [`Identify`](t7::Identify), [`Sweep`](t7::Sweep), [`Set`](t7::Set) (offset, direction, damping, range), [`SetZero`](t7::SetZero), [`ChangeAddress`](t7::ChangeAddress), [`ChangeBaud`](t7::ChangeBaud), [`AskAll`](t7::AskAll) |
//! | [ISU](isu) | [`Identify`](isu::Identify), [`ReadAngle`](isu::ReadAngle), [`GoToSoftError`](isu::GoToSoftError), [`Reset`](isu::Reset), [`ResetNull`](isu::ResetNull), [`Program`](isu::Program) (address, null position, auto-shutoff), [`Repair`](isu::Repair), [`RawWrite`](isu::raw::RawWrite) |
//! | [ISU, ASCII mode](ascii) | [`OneLine`](ascii::OneLine), [`Lines`](ascii::Lines) |
//!
//! # Rules that hold for all of them
//!
//! - The constructor refuses invalid values; the error carries the limit.
//! - Settings live in memory that wears: read, compare, write only a difference, read back. The answer to a write is
//!   not proof; the value read back is. Every report and every failure says how many writes were sent.
//! - A damaged or missing answer to a *reading* request is asked for again ([`READ_TRIES`]); a *write* is repeated
//!   only after reading has shown that it did not happen ([`WRITE_TRIES`]).
//! - [Cancelling](Operation::cancel) takes effect between two exchanges. Once something has been written, the operation
//!   goes on to its next consistent point first.
//! - A zero is written only while the sensor stands still: readings before it detect motion.
//! - The address that every sensor answers to (T7: 126, ISU: 0) is used only with a [`SingleDevice`], the caller's statement
//!   that one sensor is attached; or by [`AskAll`](t7::AskAll), which reports every answer and every suspected collision; or by
//!   a [`Sweep`](t7::Sweep), which looks only whether anything is heard.
//!
//! # Limits
//!
//! One byte of an answer changed is always noticed; several can cancel out in an 8-bit sum (one in 256). Words of an
//! ISU's EEPROM are therefore written only after two readings of them have agreed, and a T7's setting is believed to be as
//! wished only after two readings in a row.
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

pub mod ascii;
pub mod isu;
mod motion;
mod operation;
mod report;
mod runner;
mod single_device;
pub mod t7;

pub use operation::{Operation, Step, StepOf, TaskProgress};
pub use report::{Report, SettingChange};
pub use runner::{ActionOf, Commissionable, Runner, RunnerAction};
pub use single_device::SingleDevice;

/// How often a reading request is sent before its fault is final: at a character error rate of 1 % a 40-character
/// exchange fails one time in three, three of them one time in 27; noisier lines need a plumber.
pub const READ_TRIES: u8 = 3;

/// How often the same value is written, each time after reading has shown that the write before did not happen.
pub const WRITE_TRIES: u8 = 3;

/// Its example is tested.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
