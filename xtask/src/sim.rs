//! `cargo xtask sim`: the firmware image on the virtual board.

use crate::command::{self, Outcome};
use crate::steps::Steps;
use crate::{firmware, size};

/// Builds the image, prints its size, and runs it; the arguments go to the virtual board as they are.
pub fn run(arguments: &[String]) -> Outcome {
    firmware::build(&mut Steps::new("sim"))?;
    let elf = firmware::elf();
    size::print("image", &elf)?;
    let manifest = command::root().join("Cargo.toml");
    let mut board = command::cargo(["run", "--quiet", "--package", "clino-board", "--bin", "vboard"]);
    board.arg("--manifest-path").arg(manifest).arg("--");
    // Paths on the command line are relative to where the user is.
    board.current_dir(".");
    board.arg("--elf").arg(&elf).args(arguments);
    command::become_it(board)
}
