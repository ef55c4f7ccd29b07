//! `size --against REV`: how much each part of the image has grown since a revision.
//!
//! The revision is checked out in a worktree of its own below the target directory, built there with the same features, and
//! removed again. What is not committed counts as grown.

use std::fs;
use std::path::Path;
use std::process::Command;

use super::image::{Image, OTHER, PARTS};
use crate::command::{self, Failure, Outcome};
use crate::firmware::{self, PACKAGE, TARGET, WITHOUT_LOG};
use crate::steps::Steps;

/// Builds both images and prints the table.
pub fn run(revision: &str) -> Outcome {
    let folder = command::target_dir().join("against");
    let (tree, target) = (folder.join("tree"), folder.join("target"));
    fs::create_dir_all(&folder).map_err(|error| Failure::new(format!("{}: {error}", folder.display())))?;
    let mut steps = Steps::new("size --against");
    firmware::build_all(&mut steps, &[WITHOUT_LOG])?;
    remove(&tree);
    let mut add = git(&["worktree", "add", "--force", "--detach"]);
    add.arg(&tree).arg(revision);
    command::run(add)?;
    let mut build = command::cargo(["build", "--release"]);
    build.args(WITHOUT_LOG.selection()).current_dir(&tree).env("CARGO_TARGET_DIR", &target);
    let built = steps.need(revision, build);
    remove(&tree);
    built?;
    table(
        &Image::read(&WITHOUT_LOG.elf())?,
        &Image::read(&target.join(TARGET).join("release").join(PACKAGE))?,
        revision,
    );
    Ok(())
}

fn git(arguments: &[&str]) -> Command {
    let mut git = Command::new("git");
    git.args(arguments).current_dir(command::root());
    git
}

/// Removes the worktree, if it is there.
fn remove(tree: &Path) {
    let mut remove = git(&["worktree", "remove", "--force"]);
    remove.arg(tree);
    // Of a run that was broken off there may be only the folder, or only what git remembers of it.
    let _ = remove.output();
    let _ = fs::remove_dir_all(tree);
}

fn table(now: &Image, before: &Image, revision: &str) {
    println!("\n{:<24}{:>12}{:>12}{:>10}", "bytes", revision, "now", "growth");
    let row = |what: &str, before: u64, now: u64| {
        println!("{what:<24}{before:>12}{now:>12}{:>+10}", now.cast_signed() - before.cast_signed());
    };
    for part in PARTS.into_iter().chain([OTHER]) {
        row(part, before.code_of(part), now.code_of(part));
    }
    row("flash", before.flash, now.flash);
    row("static RAM", before.ram, now.ram);
}
