//! `cargo xtask lint`: everything that reads the sources without running them.

use std::process::Command;

use crate::command::{self, Outcome};
use crate::firmware::{self, PACKAGE, TARGET};

/// Formatting, clippy for host and target, documentation; a warning is a failure.
pub fn run() -> Outcome {
    let mut components = Command::new("rustup");
    components.args(["component", "add", "rustfmt", "clippy"]).current_dir(command::root());
    command::run(components)?;
    firmware::add_target()?;
    command::run(command::cargo(["fmt", "--all", "--check"]))?;
    command::run(command::cargo(["clippy", "--all-targets", "--all-features", "--", "-D", "warnings"]))?;
    command::run(command::cargo([
        "clippy",
        "--package",
        PACKAGE,
        "--target",
        TARGET,
        "--",
        "-D",
        "warnings",
    ]))?;
    // And the image without its log.
    command::run(command::cargo([
        "clippy",
        "--package",
        PACKAGE,
        "--no-default-features",
        "--target",
        TARGET,
        "--",
        "-D",
        "warnings",
    ]))?;
    let mut documentation = command::cargo(["doc", "--no-deps", "--document-private-items"]);
    documentation.env("RUSTDOCFLAGS", "-D warnings");
    command::run(documentation)?;
    let mut documentation = command::cargo([
        "doc",
        "--no-deps",
        "--document-private-items",
        "--package",
        PACKAGE,
        "--target",
        TARGET,
    ]);
    documentation.env("RUSTDOCFLAGS", "-D warnings");
    command::run(documentation)
}
