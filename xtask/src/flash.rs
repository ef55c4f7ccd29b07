//! `cargo xtask flash`: the firmware image onto a real board.

use std::process::Command;

use crate::command::{self, Failure, Outcome};
use crate::firmware;
use crate::steps::Steps;

const CHIP: &str = "STM32F407VGTx";

/// Builds the image, writes it through a debug probe, and shows its log until interrupted.
pub fn run() -> Outcome {
    if command::output_of("probe-rs", &["--version"]).is_none() {
        return Err(Failure::new(
            "probe-rs is not installed. Install it with `cargo install probe-rs-tools --locked`, \
             see https://probe.rs for other ways",
        ));
    }
    let probes = command::output_of("probe-rs", &["list"]).unwrap_or_default();
    if !probes.contains("[0]") {
        return Err(Failure::new(
            "no debug probe found. Connect the board's ST-LINK by USB; on Linux, its udev rule must let you use \
             it (https://probe.rs/docs/getting-started/probe-setup)",
        ));
    }
    firmware::build(&mut Steps::new("flash"))?;
    let elf = firmware::elf();
    let mut probe = Command::new("probe-rs");
    probe.args(["run", "--chip", CHIP]).arg(elf);
    command::run(probe)
}
