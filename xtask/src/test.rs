//! `cargo xtask test`: every test there is.

use crate::command::{self, Outcome};
use crate::{firmware, size};

/// Portable tests, then the virtual board's own, then the firmware image (built, sized) on it.
pub fn run() -> Outcome {
    command::run(command::cargo(["test"]))?;
    firmware::add_target()?;
    let selftest = ["test", "--package", "clino-board", "--test", "selftest", "--", "--include-ignored"];
    command::run(command::cargo(selftest))?;
    let elf = size::run()?;
    command::run(command::cargo(["build", "--package", "clino-board", "--bin", "vboard"]))?;
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
    board.env("CLINO_VBOARD", command::target_dir().join("debug").join("vboard"));
    command::run(board)
}
