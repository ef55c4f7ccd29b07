//! The gateway's console: what people type and read, what programs send and parse.
//!
//! Three ways to be, one at a time:
//!
//! | mode | what comes out | how to get there |
//! |---|---|---|
//! | stream | readings and statistics as they come, one JSON object per line | power-up; `watch` |
//! | people | a prompt, tables, errors in words | Enter or Ctrl-C in a stream; `json off` |
//! | program | one JSON object per line, no echo, no prompt | `json on` |
//!
//! A program may send commands while it watches the stream; the answers come between the readings.
//!
//! Sans-IO: [`Shell`] takes bytes and is polled; text goes to an `embedded_io::Write`; the gateway is a [`Host`].
//! Line editing, history, completion and `help` are `embedded-cli`'s.
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

mod arguments;
mod causes;
mod command;
mod echo;
mod error;
mod execute;
mod fields;
mod host;
mod news;
mod shell;
mod stream;
mod table;
mod tasks;
mod text;

pub use host::{BusState, Host};
pub use shell::Shell;
