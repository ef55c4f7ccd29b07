//! `cargo xtask flash`: the firmware image onto a real board.

use std::process::Command;

use crate::boards::Board;
use crate::command::{self, Failure, Outcome};
use crate::firmware::{self, Variant};
use crate::steps::Steps;

/// Builds the image, writes it through a debug probe, and shows its log until interrupted.
pub fn run(board: Board) -> Outcome {
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
    let variant = Variant::of(board);
    firmware::build_all(&mut Steps::new("flash"), &[variant])?;
    let mut probe = Command::new("probe-rs");
    probe.args(["run", "--chip", board.chip]).arg(variant.elf());
    command::run(probe)
}
