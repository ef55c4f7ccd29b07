//! Stock programs that know nothing of us, for tests: installed once, below the target directory, without root. Tests that
//! run at the same time, in one process or in several, wait for each other.
//!
//! Needs the network the first time, and `python3` with venv or pip, `npm`, or on a Debian `apt-get` and `dpkg`. What cannot be
//! had is an error that says what was tried; a test decides whether it fails, or says that it was skipped ([`skipped`]).

mod debian;
mod libmodbus;
mod mbpoll;
mod node;
mod python;

use std::fs::{self, File};
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Output};

pub use libmodbus::Libmodbus;
pub use mbpoll::Mbpoll;
pub use node::Node;
pub use python::Python;

/// Says on standard error that a test did not test what it is for, and why: also when the test's own output is
/// captured.
pub fn skipped(test: &str, why: &str) {
    let _ = writeln!(std::io::stderr(), "SKIPPED {test}: {why}");
}

/// Waits until no other process installs something below `place`; others wait until what this returns is dropped.
fn alone(place: &Path) -> Result<File, String> {
    let lock = place.join("installing.lock");
    let file = fs::create_dir_all(place).and_then(|()| File::create(&lock));
    let locked = file.and_then(|file| file.lock().map(|()| file));
    locked.map_err(|why| format!("{}: {why}\n", lock.display()))
}

/// Runs a step of an installation; what it said if it failed.
fn done(command: &mut Command) -> Result<Output, String> {
    match command.output() {
        Ok(output) if output.status.success() => Ok(output),
        Ok(output) => Err(format!("{command:?}: {}\n", said(&output))),
        Err(error) => Err(format!("{command:?}: {error}\n")),
    }
}

/// How a program ended and what it printed.
pub fn said(output: &Output) -> String {
    let [stdout, stderr] = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text));
    format!("{}\n{stdout}{stderr}", output.status)
}
