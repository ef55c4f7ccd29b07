//! Stock programs that know nothing of us, for tests: installed once, below the target directory, without root.
//!
//! Needs the network the first time, and `python3` with venv or pip, `npm`, or on a Debian `apt-get` and `dpkg`. What cannot be
//! had is an error that says what was tried; a test decides whether it fails, or says that it was skipped ([`skipped`]).

mod debian;
mod libmodbus;
mod mbpoll;
mod node;
mod python;

use std::io::Write as _;
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
