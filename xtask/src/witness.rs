//! `cargo xtask witness`: the image on a second, independent emulator, and the two instruction interpreters held against each
//! other. `docs/witness.md` says what it shows.
//!
//! The emulator asks for a newer compiler than the project and takes a quarter of an hour to build. So it is a workspace of
//! its own (`witness/`), built into a folder of cargo's home that all checkouts of a machine share, by a toolchain that is
//! named here. This command installs both; the daily run only uses them, and says so loudly where they are missing.

use std::env;
use std::fs;
use std::io::{self, Write};
use std::path::PathBuf;
use std::process::Command;

use crate::boards;
use crate::command::{self, Failure, Outcome};
use crate::firmware;
use crate::hil;
use crate::steps::{self, Step, Steps};

/// The compiler that the emulator asks for.
const TOOLCHAIN: &str = "1.98";
/// The package, and its program.
const PACKAGE: &str = "clino-witness";
/// Of the daily run: random sequences, calls of each function of the image, seed.
const DAILY: [&str; 3] = ["2000", "1", "1"];

/// Installs it if it is missing, and runs it.
pub fn run() -> Outcome {
    let mut steps = Steps::new("witness");
    let planned = install_and_run(&mut steps);
    steps.end(planned)
}

fn install_and_run(steps: &mut Steps) -> Outcome {
    firmware::build(steps)?;
    install(steps)?;
    steps.run("witness tests", cargo("test"));
    steps.run("witness", image());
    steps.run("cpu", cpu(&DAILY));
    Ok(())
}

/// The image on QEMU, as a smoke test: answers, no times. The report stays below the target directory.
pub fn qemu() -> Outcome {
    let report = command::target_dir().join("qemu.md");
    hil::run(boards::DEFAULT, &["--qemu".to_owned(), "--report".to_owned(), report.display().to_string()])
}

/// Builds the program, and installs what that takes.
pub fn install(steps: &mut Steps) -> Outcome {
    if command::output_of("rustup", &["run", TOOLCHAIN, "rustc", "--version"]).is_none() {
        let mut rustup = Command::new("rustup");
        rustup.args(["toolchain", "install", TOOLCHAIN, "--profile", "minimal"]).current_dir(command::root());
        steps.need("toolchain", rustup)?;
    }
    build(steps)?;
    fs::write(stamp(), lock()).map_err(|error| failed(&stamp(), &error))
}

/// Steps of the daily run, where the emulator is installed; else a loud note.
pub fn daily(steps: &mut Steps) -> Result<Vec<Step>, Failure> {
    if fs::read(stamp()).ok() != Some(lock()) {
        let note = "SKIPPED: the image on the second emulator, and the comparison of the cores: it is not installed; \
                    `cargo xtask witness` installs it, once a machine (a quarter of an hour)";
        eprintln!("{note}");
        let file = fs::OpenOptions::new().create(true).append(true).open(steps::skipped());
        file.and_then(|mut file| writeln!(file, "{note}"))
            .map_err(|error| failed(&steps::skipped(), &error))?;
        return Ok(Vec::new());
    }
    build(steps)?;
    Ok(vec![Step::new("witness", image()), Step::new("witness cpu", cpu(&DAILY))])
}

/// The comparison of the cores: random sequences, calls of each function of the image, seed.
pub fn cpu(numbers: &[&str]) -> Command {
    let mut command = Command::new(program());
    command.arg("cpu").args(numbers).arg(firmware::SHIPPED.elf()).current_dir(command::root());
    command
}

/// The image on the second emulator.
fn image() -> Command {
    let mut command = Command::new(program());
    command.arg("image").arg(firmware::SHIPPED.elf()).arg("docs/registers.md").current_dir(command::root());
    command
}

fn build(steps: &mut Steps) -> Outcome {
    steps.need("second emulator", cargo("build"))?;
    // Other checkouts build into the same folder.
    let built = folder().join("release").join(PACKAGE);
    fs::copy(&built, program()).map_err(|error| failed(&built, &error))?;
    Ok(())
}

/// `cargo build` or `cargo test` of the program.
fn cargo(verb: &str) -> Command {
    let mut cargo = Command::new("rustup");
    cargo.args(["run", TOOLCHAIN, "cargo", verb, "--release", "--locked"]);
    cargo.args(["--manifest-path", "witness/Cargo.toml"]);
    cargo.env("CARGO_TARGET_DIR", folder()).env_remove("CARGO").current_dir(command::root());
    cargo
}

/// What was built last, of this checkout.
fn program() -> PathBuf {
    command::target_dir().join(PACKAGE)
}

/// Where all checkouts of this machine build it.
fn folder() -> PathBuf {
    let home = env::var_os("CARGO_HOME").map(PathBuf::from);
    let home = home.or_else(|| env::home_dir().map(|home| home.join(".cargo")));
    home.unwrap_or_else(command::target_dir).join(PACKAGE)
}

/// Holds what it was built of, once it was.
fn stamp() -> PathBuf {
    folder().join("installed")
}

fn lock() -> Vec<u8> {
    fs::read(command::root().join("witness/Cargo.lock")).unwrap_or_default()
}

fn failed(path: &std::path::Path, error: &io::Error) -> Failure {
    Failure::new(format!("{}: {error}", path.display()))
}
