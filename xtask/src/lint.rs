//! `cargo xtask lint`: everything that reads the sources without running them.

use std::process::Command;

use crate::command::{self, Outcome};
use crate::firmware::{self, SHIPPED, Variant, WITHOUT_LOG};
use crate::steps::Steps;
use crate::{boards, book};

/// Formatting, clippy for host and target, documentation; a warning is a failure.
pub fn run() -> Outcome {
    let mut steps = Steps::new("lint");
    let planned = all(&mut steps);
    steps.end(planned)
}

fn all(steps: &mut Steps) -> Outcome {
    let mut components = Command::new("rustup");
    components.args(["component", "add", "rustfmt", "clippy"]).current_dir(command::root());
    steps.need("rustfmt and clippy", components)?;
    firmware::add_target()?;
    steps.run("formatting", command::cargo(["fmt", "--all", "--check"]));
    steps.run("clippy", clippy(["--all-targets", "--all-features"]));
    steps.run(
        "clippy of few nodes",
        clippy(["--package", "clino-drivers", "--no-default-features", "--features", "nb"]),
    );
    let image = |variant: Variant| variant.selection();
    steps.run("clippy of the image", clippy(as_str(&image(SHIPPED))));
    for variant in [WITHOUT_LOG, Variant::of(boards::NUCLEO)] {
        steps.run(&format!("clippy of the {}", variant.step()), clippy(as_str(&image(variant))));
    }
    // With the features of the first clippy, so that what the crates depend on is read once.
    steps.run("documentation", documentation(["--all-features"]));
    steps.run("documentation of the image", documentation(as_str(&image(SHIPPED))));
    if let Err(failure) = steps.own("book", book::check) {
        eprintln!("FAILED {failure}");
    }
    Ok(())
}

fn clippy<'a>(selection: impl IntoIterator<Item = &'a str>) -> Command {
    let mut clippy = command::cargo(["clippy"].into_iter().chain(selection));
    clippy.args(["--", "-D", "warnings"]);
    clippy
}

fn documentation<'a>(selection: impl IntoIterator<Item = &'a str>) -> Command {
    let mut doc =
        command::cargo(["doc", "--no-deps", "--document-private-items"].into_iter().chain(selection));
    doc.env("RUSTDOCFLAGS", "-D warnings");
    doc
}

fn as_str(words: &[String]) -> impl Iterator<Item = &str> {
    words.iter().map(String::as_str)
}
