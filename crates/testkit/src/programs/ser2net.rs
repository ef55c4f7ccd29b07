//! `ser2net`, which passes the bytes of a serial port through TCP: the machine's own, or the one of its distribution,
//! unpacked below the target directory.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::{alone, debian};

/// It, and the libraries it is linked to that a Debian need not have.
const PACKAGES: [&str; 5] = ["ser2net", "libgensio4", "libyaml-0-2", "libsctp1", "libwrap0"];

/// A program `ser2net`, version 4.
pub struct Ser2net {
    program: PathBuf,
    /// Folders of its libraries and of their modules, if they are not the system's.
    folders: Option<[PathBuf; 2]>,
}

impl Ser2net {
    /// The machine's own, or one that is unpacked below `place`.
    ///
    /// # Errors
    /// What was tried, and what the programs said.
    pub fn get(place: &Path) -> Result<Ser2net, String> {
        for program in ["ser2net", "/usr/sbin/ser2net"] {
            let own = Ser2net { program: program.into(), folders: None };
            if own.works() {
                return Ok(own);
            }
        }
        let root = place.join("ser2net");
        let _alone = alone(&root)?;
        if let Some(unpacked) = Ser2net::unpacked(&root) {
            return Ok(unpacked);
        }
        debian::unpack(&root, &PACKAGES)?;
        Ser2net::unpacked(&root).ok_or_else(|| "ser2net was unpacked, and does not start\n".to_owned())
    }

    /// It, without arguments.
    pub fn command(&self) -> Command {
        let mut command = Command::new(&self.program);
        if let Some([libraries, modules]) = &self.folders {
            command.env("LD_LIBRARY_PATH", libraries).env("GENSIO_LIBRARY_PATH", modules);
        }
        command
    }

    fn unpacked(root: &Path) -> Option<Ser2net> {
        let libraries = only(&root.join("usr/lib"))?;
        let modules = only(&only(&root.join("usr/libexec"))?.join("gensio"))?;
        let program = root.join("usr/sbin/ser2net");
        let ser2net = Ser2net { program, folders: Some([libraries, modules]) };
        ser2net.works().then_some(ser2net)
    }

    fn works(&self) -> bool {
        let version = self.command().arg("-v").stdin(Stdio::null()).stderr(Stdio::null()).output();
        version.is_ok_and(|output| String::from_utf8_lossy(&output.stdout).contains("version 4"))
    }
}

/// The folder in a folder that has one alone: it is named after the machine, or after a version.
fn only(folder: &Path) -> Option<PathBuf> {
    let entries = fs::read_dir(folder).ok()?.filter_map(Result::ok).map(|entry| entry.path());
    entries.filter(|path| path.is_dir()).min()
}
