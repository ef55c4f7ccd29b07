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
//! Only lines that were typed, whole, are carried out: see `line.rs`.
//!
//! Sans-IO: [`Shell`] takes characters and is polled; text goes to an [`Out`], such as any `embedded_io::Write` as a [`Port`]; the gateway is a [`Host`]. What can
//! be typed is a table (`command.rs`).
//!
//! Irreversible commands ask for confirmation: people answer `y`, a program adds `--yes` to the command.
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

mod alarms;
mod audience;
mod buses;
mod causes;
mod choice;
mod command;
mod complete;
mod consequences;
mod diagnostics;
mod editor;
mod error;
mod execute;
mod export;
mod extremes;
mod features;
mod help;
mod history;
mod host;
mod identity;
mod job;
mod json;
mod keys;
mod label;
mod line;
mod meter;
mod news;
mod number;
mod out;
mod pending;
mod presence;
mod received;
mod reply;
mod reporter;
mod rows;
mod sensor_task;
mod settings;
mod shell;
mod slots;
mod split;
mod stream;
mod system;
mod table;
mod tasks;
mod typed;
mod value;
mod words;

pub use audience::Audience;
pub use causes::{after_isu, after_t7};
pub use host::{BusState, BusWork, Host, Saved, StorageError};
pub use json::MAX_LINE;
pub use line::LONGEST_LINE;
pub use news::write_outcome;
pub use out::{Out, Port};
pub use received::Received;
pub use shell::Shell;
