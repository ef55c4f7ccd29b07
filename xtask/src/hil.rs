//! `cargo xtask hil`: the image on a board with this computer at its ports, or on the virtual board (`--virtual`), and a report.

use std::process::Command;

use crate::command::{self, Outcome};
use crate::firmware;
use crate::steps::Steps;

/// Builds the image and the programs, and runs; the arguments go to `xtask/hil` as they are.
pub fn run(arguments: &[String]) -> Outcome {
    let mut steps = Steps::new("hil");
    if !arguments.iter().any(|argument| argument == "--help" || argument == "-h") {
        firmware::build(&mut steps)?;
    }
    let packages = ["--package", "clino", "--package", "clino-board", "--package", "clino-hil"];
    steps.need("programs", command::cargo(["build", "--bins"].into_iter().chain(packages)))?;
    let programs = command::target_dir().join("debug");
    let mut hil = Command::new(programs.join("clino-hil"));
    hil.arg("--elf").arg(firmware::SHIPPED.elf()).arg("--programs").arg(programs).args(arguments);
    command::become_it(hil)
}
