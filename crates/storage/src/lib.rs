//! What the gateway keeps in flash: its configuration ([`Store`]), and how often power came ([`Tally`]). After a power cut
//! the configuration is the old one or the new one, never a mix, never none.
//!
//! [`Store`] keeps one [`record`] with everything that is configured: 48 slots, both buses, the Modbus port, the console.
//! The record is one item of a `sequential-storage` map: written behind the last one, found again by being the newest that
//! is whole. Between that library and the flash are the [`pages`], which make an erase one step.
//!
//! ```text
//! Store ── record: version, content, CRC-32
//!   │
//! sequential-storage: one item, CRC-32C; the newest whole one counts
//!   │
//! Pages: a sector is marked when it was erased to the end
//!   │
//! embedded-storage `NorFlash`, as `dyn Sectors`: three sectors of 16 KiB
//! ```
//!
//! # Wear
//!
//! The part bears 10 000 erases of a sector (DS8626 table 42). The library uses the three sectors in turn and erases one
//! when another is full, so that a sector is erased once in as many saves as fit in all three:
//!
//! | | record | in flash, with its header | saves per sector | endurance in saves |
//! |---|---|---|---|---|
//! | the longest the gateway takes, all slots with names of 16 characters | 3964 bytes | 3972 bytes | 4 | 119 000 |
//! | all 48 slots as usual | 156 bytes | 164 bytes | 99 | 2 857 000 |
//!
//! A save that changes nothing costs nothing: the flash is not touched. `tests/wear.rs` measures these figures.
//!
//! # Limits
//!
//! - The erase of a sector stalls this part for 250 to 500 ms (DS8626 table 40). It happens within [`Store::save`] and
//!   [`Store::factory_reset`], never in [`Store::load`]; [`Store::erases`] counts.
//! - A record that changed in flash looks like one whose writing was cut off: the record before it is
//!   loaded then, if it is still there.
//! - A bit that reads differently at each access, after a torn word, is not handled: what was once read as whole
//!   counts as whole.
//! - RAM: a [`Store`] is 3980 bytes for the longest record ([`record::LONGEST`]), and about 40 for the rest.
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

pub mod pages;
pub mod record;
mod store;
pub mod tally;
mod wait;

pub use pages::{FlashError, Sectors};
pub use record::Reject;
pub use store::{LoadError, Loaded, SaveError, SaveOutcome, Store};
pub use tally::Tally;
