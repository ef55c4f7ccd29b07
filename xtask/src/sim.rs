//! `cargo xtask sim`: the firmware image on the virtual board.

use crate::boards::Board;
use crate::command::{self, Outcome};
use crate::firmware::{self, Variant};
use crate::size;
use crate::steps::Steps;

/// Builds the image for a board, prints its size, and runs it; the arguments go to the virtual board as they are.
pub fn run(on: Board, arguments: &[String]) -> Outcome {
    let variant = Variant::of(on);
    firmware::build_all(&mut Steps::new("sim"), &[variant])?;
    let elf = variant.elf();
    size::print("image", &elf)?;
    let manifest = command::root().join("Cargo.toml");
    let mut board = command::cargo(["run", "--quiet", "--package", "clino-board", "--bin", "vboard"]);
    board.arg("--manifest-path").arg(manifest).arg("--");
    // Paths on the command line are relative to where the user is.
    board.current_dir(".");
    board.arg("--elf").arg(&elf).args(["--board", on.name]).args(arguments);
    command::become_it(board)
}
