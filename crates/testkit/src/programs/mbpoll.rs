//! `mbpoll`, the Modbus master that people have at hand: the machine's own, or the one of its distribution, unpacked
//! below the target directory.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::{alone, debian};

/// It, and the library it is linked to.
const PACKAGES: [&str; 2] = ["mbpoll", "libmodbus5"];

/// A program `mbpoll`.
pub struct Mbpoll {
    program: PathBuf,
    /// Folders of its libraries, if they are not the system's.
    libraries: OsString,
}

impl Mbpoll {
    /// The machine's own, or one that is unpacked below `place`.
    ///
    /// # Errors
    /// What was tried, and what the programs said.
    pub fn get(place: &Path) -> Result<Mbpoll, String> {
        let own = Mbpoll { program: "mbpoll".into(), libraries: OsString::new() };
        if own.works() {
            return Ok(own);
        }
        let root = place.join("mbpoll");
        let _alone = alone(&root)?;
        if let Some(unpacked) = Mbpoll::unpacked(&root) {
            return Ok(unpacked);
        }
        debian::unpack(&root, &PACKAGES)?;
        Mbpoll::unpacked(&root).ok_or_else(|| "mbpoll was unpacked, and does not start\n".to_owned())
    }

    /// It, without arguments.
    pub fn command(&self) -> Command {
        let mut command = Command::new(&self.program);
        if !self.libraries.is_empty() {
            command.env("LD_LIBRARY_PATH", &self.libraries);
        }
        command
    }

    fn unpacked(root: &Path) -> Option<Mbpoll> {
        let folders = fs::read_dir(root.join("usr/lib")).ok()?;
        let folders = folders.filter_map(Result::ok).map(|entry| entry.path());
        let mbpoll =
            Mbpoll { program: root.join("usr/bin/mbpoll"), libraries: std::env::join_paths(folders).ok()? };
        mbpoll.works().then_some(mbpoll)
    }

    fn works(&self) -> bool {
        self.command().arg("-V").output().is_ok_and(|output| output.status.success())
    }
}
