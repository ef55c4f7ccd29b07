//! Stock programs that know nothing of us, for tests: installed once, below the target directory, without root. Tests that
//! run at the same time, in one process or in several, wait for each other.
//!
//! Needs the network the first time, and `python3` with venv or pip, `npm`, or on a Debian `apt-get` and `dpkg`. What cannot be
//! had is an error that says what was tried; a test decides whether it fails, or says that it was skipped ([`skipped`]).

mod chromium;
mod debian;
mod faketime;
mod libmodbus;
mod mbpoll;
mod monitors;
mod mosquitto;
mod node;
mod python;
mod qemu;
mod ser2net;
mod sigrok;

use std::fs::{self, File};
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Output};

pub use chromium::Chromium;
pub use faketime::Faketime;
pub use libmodbus::Libmodbus;
pub use mbpoll::Mbpoll;
pub use monitors::Monitor;
pub use mosquitto::Mosquitto;
pub use node::Node;
pub use python::Python;
pub use qemu::Qemu;
pub use ser2net::Ser2net;
pub use sigrok::Sigrok;

/// Says on standard error that a test did not test what it is for, and why: also when the test's own output is captured.
/// `cargo nextest` shows nothing of tests that pass: what is in the file that `CLINO_SKIPPED` names is shown at the end
/// (`cargo xtask test`).
pub fn skipped(test: &str, why: &str) {
    let said = format!("SKIPPED {test}: {why}\n");
    let _ = std::io::stderr().write_all(said.as_bytes());
    if let Some(list) = std::env::var_os("CLINO_SKIPPED") {
        // What cannot be noted was said.
        let _ = note(Path::new(&list), &said);
    }
}

/// Adds to a file that several tests add to at the same time.
fn note(list: &Path, said: &str) -> std::io::Result<()> {
    File::options().create(true).append(true).open(list)?.write_all(said.as_bytes())
}

/// Waits until no other process installs something below `place`; others wait until what this returns is dropped.
fn alone(place: &Path) -> Result<File, String> {
    let lock = place.join("installing.lock");
    let file = fs::create_dir_all(place).and_then(|()| File::create(&lock));
    let locked = file.and_then(|file| file.lock().map(|()| file));
    locked.map_err(|why| format!("{}: {why}\n", lock.display()))
}

/// Folders with libraries of packages that were unpacked below `root`, as the loader takes them.
fn library_folders(root: &Path) -> String {
    let below = |lib: &str| fs::read_dir(root.join(lib)).into_iter().flatten().filter_map(Result::ok);
    let entries = below("lib").chain(below("usr/lib"));
    let folders = entries.map(|entry| entry.path()).filter(|path| path.is_dir());
    folders.map(|path| path.display().to_string()).collect::<Vec<_>>().join(":")
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_skipped_is_noted_line_by_line() {
        let list = std::env::temp_dir().join(format!("clino-skipped-{}", std::process::id()));
        for said in ["SKIPPED one: why\n", "SKIPPED two: why\n"] {
            note(&list, said).expect("a folder for temporary files");
        }
        let noted = fs::read_to_string(&list).expect("it is there");
        fs::remove_file(&list).expect("it is there");
        assert_eq!(noted, "SKIPPED one: why\nSKIPPED two: why\n");
    }
}
