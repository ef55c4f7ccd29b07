//! Building the firmware image.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use crate::command::{self, Failure, Outcome};
use crate::steps::Steps;

/// Cortex-M4 with its floating-point unit.
pub const TARGET: &str = "thumbv7em-none-eabihf";
/// The root package.
pub const PACKAGE: &str = "clino-firmware";

/// Where the release image is.
pub fn elf() -> PathBuf {
    command::target_dir().join(TARGET).join("release").join(PACKAGE)
}

/// Where the release image without its log is.
pub fn elf_without_log() -> PathBuf {
    elf().with_file_name(format!("{PACKAGE}-without-log"))
}

/// Builds the release image.
pub fn build(steps: &mut Steps) -> Outcome {
    add_target()?;
    steps.need("image", build_command())
}

/// Builds the release image, with its log and without. Both are built in one folder, so that what they have in common is
/// built once; the one with its log stays where everybody looks for it.
pub fn build_both(steps: &mut Steps) -> Outcome {
    add_target()?;
    let mut without = build_command();
    without.arg("--no-default-features");
    steps.need("image without its log", without)?;
    let (from, to) = (elf(), elf_without_log());
    let failed = |error| Failure::new(format!("{} to {}: {error}", from.display(), to.display()));
    fs::copy(&from, &to).map_err(failed)?;
    steps.need("image", build_command())
}

fn build_command() -> Command {
    command::cargo(["build", "--release", "--package", PACKAGE, "--target", TARGET])
}

/// Installs the target's standard library if it is missing.
pub fn add_target() -> Outcome {
    let installed = command::output_of("rustup", &["target", "list", "--installed"]).ok_or_else(|| {
        Failure::new(format!("rustup is missing; it is needed to install the target {TARGET}"))
    })?;
    if installed.lines().any(|line| line == TARGET) {
        return Ok(());
    }
    let mut rustup = Command::new("rustup");
    rustup.args(["target", "add", TARGET]).current_dir(command::root());
    command::run(rustup)
}
