//! The firmware image, unmodified, on the second emulator, with the project's simulated sensors.

mod bus;
mod checks;
mod core;
mod gateway;
mod hosts;
mod part;
mod registers;
mod run;

use std::path::Path;

pub use checks::Report;

/// Runs every check on the image at `elf`, whose contents are `bytes`; `registers` is the text of `docs/registers.md`.
pub fn witness(elf: &Path, bytes: &[u8], registers: &str) -> Result<Report, String> {
    checks::all(elf, bytes, registers)
}
