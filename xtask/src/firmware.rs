//! Building the firmware image.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::command::{self, Failure, Outcome};

/// Cortex-M4 with its floating-point unit.
pub const TARGET: &str = "thumbv7em-none-eabihf";
/// The root package.
pub const PACKAGE: &str = "clino-firmware";

/// Builds the release image and returns where it is.
pub fn build() -> Result<PathBuf, Failure> {
    add_target()?;
    command::run(command::cargo(["build", "--release", "--package", PACKAGE, "--target", TARGET]))?;
    Ok(command::target_dir().join(TARGET).join("release").join(PACKAGE))
}

/// Builds the image without its log, in a folder of its own, and returns where it is.
pub fn build_without_log() -> Result<PathBuf, Failure> {
    add_target()?;
    let folder = command::target_dir().join("without-log");
    let mut cargo = command::cargo(["build", "--release", "--package", PACKAGE, "--target", TARGET]);
    cargo.arg("--no-default-features").arg("--target-dir").arg(&folder);
    command::run(cargo)?;
    Ok(folder.join(TARGET).join("release").join(PACKAGE))
}

/// A suite of tests of this image on the virtual board.
pub fn suite(elf: &Path, name: &str) -> Command {
    let package = ["test", "--package", "clino-host-tests", "--features", "virtual-board", "--test", name];
    let mut tests = command::cargo(package);
    tests.env("CLINO_ELF", elf);
    tests.env("CLINO_VBOARD", command::target_dir().join("debug").join("vboard"));
    tests
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
