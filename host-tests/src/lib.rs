//! Runs the shipped firmware image through a scenario and keeps everything a test may want to look at.
//!
//! The image is the file named by `CLINO_ELF`, the board it is for is named by `CLINO_BOARD` (without it, the default one);
//! `cargo xtask test` builds it and sets them.

#[cfg(feature = "virtual-board")]
pub mod modbus;
#[cfg(feature = "virtual-board")]
mod ran;

#[cfg(feature = "virtual-board")]
pub use ran::{Ran, Spoken, elf, image, model, run, run_file};

#[cfg(all(test, not(feature = "virtual-board")))]
mod tests {
    #[test]
    #[ignore = "the firmware is not tested by plain `cargo test`: run `cargo xtask test`"]
    fn firmware_on_the_virtual_board() {}
}
