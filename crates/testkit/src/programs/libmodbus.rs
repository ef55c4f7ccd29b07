//! A C program that is linked to libmodbus: the machine's own, or the one of its distribution, unpacked below the target
//! directory.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::{debian, done};

/// The library, and what a compiler needs of it.
const PACKAGES: [&str; 2] = ["libmodbus-dev", "libmodbus5"];

/// A program that uses libmodbus.
pub struct Libmodbus {
    program: PathBuf,
    /// Folders of the library, if they are not the system's.
    libraries: OsString,
}

impl Libmodbus {
    /// Compiles `source` below `place`.
    ///
    /// # Errors
    /// What was tried, and what the programs said.
    pub fn compile(place: &Path, source: &Path) -> Result<Libmodbus, String> {
        let root = place.join("libmodbus");
        fs::create_dir_all(&root).map_err(|why| format!("{}: {why}\n", root.display()))?;
        let program = root.join("program");
        let cc = || {
            let mut cc = Command::new("cc");
            cc.args(["-std=c11", "-Wall", "-o"]).arg(&program).arg(source);
            cc
        };
        let with_own = done(cc().args(["-I/usr/include/modbus", "-lmodbus"]));
        let Err(first) = with_own else { return Ok(Libmodbus { program, libraries: OsString::new() }) };
        let include = root.join("usr/include/modbus");
        if !include.exists() {
            debian::unpack(&root, &PACKAGES).map_err(|second| format!("{first}{second}"))?;
        }
        let folders = fs::read_dir(root.join("usr/lib")).map_err(|why| format!("{first}{why}\n"))?;
        let folders: Vec<PathBuf> = folders.filter_map(Result::ok).map(|entry| entry.path()).collect();
        let mut cc = cc();
        cc.arg("-I").arg(&include);
        for folder in &folders {
            cc.arg("-L").arg(folder);
        }
        done(cc.arg("-lmodbus")).map_err(|second| format!("{first}{second}"))?;
        let libraries = std::env::join_paths(folders).map_err(|why| format!("{why}\n"))?;
        Ok(Libmodbus { program, libraries })
    }

    /// It, without arguments.
    pub fn command(&self) -> Command {
        let mut command = Command::new(&self.program);
        if !self.libraries.is_empty() {
            command.env("LD_LIBRARY_PATH", &self.libraries);
        }
        command
    }
}
