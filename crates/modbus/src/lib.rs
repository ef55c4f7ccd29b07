//! Modbus RTU server of an inclinometer gateway: the serial line, the functions, and one register map.
//!
//! Sans-IO. [`Server`] takes characters with the receiver's error flags and the time; when the silence after a request is
//! over, one call of [`Server::poll`] makes the answer, and [`Server::poll_at`] says when that is. A [`Host`] supplies
//! the registers and takes the changes; [`binding`] makes the gateway core one. The [`map`] is a table from which the server's
//! lookups, `docs/modbus.md` and `docs/modbus.csv` are made.
//!
//! | function | |
//! |---|---|
//! | 03, 04 | read registers; both read the same |
//! | 06, 16 | write; checked whole before anything is done |
//! | 08 | sub-functions 0, 1, 2, 10 to 15, 18 |
//! | 43 / 14 | identification, basic and regular |
//!
//! Nothing else is answered: not an answer, not an echo of our own at once (`own.rs`) or late (`repeat.rs`), not a write
//! with zeros behind it (`request.rs`). Pauses below t3.5 within a request are a matter of [`settings`].
//!
//! Limits: frames of 256 bytes; one request at a time. The longest call is a reading request for 125 registers: each is
//! looked for once, in a table of known size.
//!
//! Why not `rmodbus` 0.13: it answers a function that it does not know before it looks at the checksum, and takes a
//! function 16 whose byte count and quantity differ, and a frame with more behind it. It has no function 08 and no
//! identification, no way to add them, and no timing. Its arithmetic on a received length (`7 + bytes`, in a `u8`) can
//! overflow, and its slices can panic, which nothing linked here may. What would be left of it is a checksum and three
//! frame layouts.
//!
//! Sources: MODBUS Application Protocol Specification V1.1b3; MODBUS over Serial Line Specification and Implementation
//! Guide V1.02.
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

pub mod binding;
mod bits;
pub mod command;
pub mod crc;
mod diagnostics;
mod exception;
mod frame;
mod functions;
mod host;
mod identification;
pub mod map;
pub mod number;
mod own;
mod parts;
mod receiver;
mod repeat;
mod request;
mod server;
pub mod settings;
mod values;
mod write;

pub use bits::slot_bits;
pub use diagnostics::Counters;
pub use exception::Exception;
pub use frame::MAX_FRAME;
pub use host::{Host, Refusal, Write};
pub use identification::Identification;
pub use map::SLOTS;
pub use parts::parts;
pub use server::Server;
pub use settings::Settings;
pub use values::Values;
