//! `cargo xtask hil`: the image on a board with this computer at its ports, or on the virtual board (`--virtual`), and a report.

use std::process::Command;

use crate::boards::{self, Board};
use crate::command::{self, Failure, Outcome};
use crate::firmware::{self, Variant};
use crate::steps::Steps;

/// Builds the board's image and the programs, and runs; the other arguments go to `xtask/hil` as they are.
pub fn run(board: Board, arguments: &[String]) -> Outcome {
    let has = |option: &str| arguments.iter().any(|argument| argument == option);
    if has("--qemu") && board != boards::DEFAULT {
        let message =
            format!("--qemu: its machine has the chip of the {}, and no other", boards::DEFAULT.name);
        return Err(Failure { message, status: crate::BAD_USAGE });
    }
    let mut steps = Steps::new("hil");
    let variant = Variant::of(board);
    if !has("--help") && !has("-h") {
        firmware::build_all(&mut steps, &[variant])?;
    }
    let packages = ["--package", "clino", "--package", "clino-board", "--package", "clino-hil"];
    steps.need("programs", command::cargo(["build", "--bins"].into_iter().chain(packages)))?;
    let programs = command::target_dir().join("debug");
    let mut hil = Command::new(programs.join("clino-hil"));
    hil.arg("--elf").arg(variant.elf()).arg("--programs").arg(programs);
    hil.args(["--board", board.name, "--chip", board.chip]).args(arguments);
    command::become_it(hil)
}
