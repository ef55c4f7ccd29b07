//! `cargo xtask test`: every test there is.

use crate::command::{self, Outcome};
use crate::{firmware, size};

/// Portable tests, then the firmware image (built, sized) on the virtual board.
pub fn run() -> Outcome {
    command::run(command::cargo(["test"]))?;
    let elf = firmware::build()?;
    size::run()?;
    let mut board = command::cargo([
        "test",
        "--package",
        "clino-host-tests",
        "--features",
        "virtual-board",
        "--test",
        "board",
    ]);
    board.env("CLINO_ELF", &elf);
    command::run(board)
}
