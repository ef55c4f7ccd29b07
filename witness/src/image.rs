//! The firmware image, unmodified, on the second emulator, with the project's simulated sensors.

mod bus;
mod checks;
mod core;
mod gateway;
mod hosts;
mod part;
mod run;

use std::path::Path;

pub use checks::Report;

/// Runs every check on the image at `elf`; `registers` is the text of `docs/registers.md`.
pub fn witness(elf: &Path, registers: &str) -> Result<Report, String> {
    let bytes = std::fs::read(elf).map_err(|error| format!("{}: {error}", elf.display()))?;
    checks::all(elf, &bytes, registers)
}
