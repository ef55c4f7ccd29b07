//! `sigrok-cli`, which decodes captures of logic analysers: the machine's own, or the one of its distribution, unpacked below
//! the target directory with what it needs.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::{alone, debian};

/// A program `sigrok-cli` with the decoders it came with.
pub struct Sigrok {
    program: PathBuf,
    /// Folders of its libraries and of its data, if they are not the system's.
    folders: Option<[PathBuf; 2]>,
}

impl Sigrok {
    /// The machine's own, or one that is unpacked below `place`.
    ///
    /// # Errors
    /// What was tried, and what the programs said.
    pub fn get(place: &Path) -> Result<Sigrok, String> {
        let own = Sigrok { program: "sigrok-cli".into(), folders: None };
        if own.works() {
            return Ok(own);
        }
        let root = place.join("sigrok");
        let _alone = alone(&root)?;
        if let Some(unpacked) = Sigrok::unpacked(&root) {
            return Ok(unpacked);
        }
        debian::unpack_with_dependencies(&root, "sigrok-cli")?;
        Sigrok::unpacked(&root).ok_or_else(|| "sigrok-cli was unpacked, and does not start\n".to_owned())
    }

    /// It, without arguments.
    pub fn command(&self) -> Command {
        let mut command = Command::new(&self.program);
        if let Some([libraries, data]) = &self.folders {
            command.env("LD_LIBRARY_PATH", libraries).env("XDG_DATA_DIRS", data);
        }
        command
    }

    fn unpacked(root: &Path) -> Option<Sigrok> {
        // It is named after the machine.
        let folders =
            fs::read_dir(root.join("usr/lib")).ok()?.filter_map(Result::ok).map(|entry| entry.path());
        let libraries = folders.filter(|path| path.is_dir()).min()?;
        let program = root.join("usr/bin/sigrok-cli");
        let sigrok = Sigrok { program, folders: Some([libraries, root.join("usr/share")]) };
        sigrok.works().then_some(sigrok)
    }

    /// It starts and finds the decoder that ours are stacked on.
    fn works(&self) -> bool {
        let about = self.command().args(["-P", "uart", "--show"]).output();
        about.is_ok_and(|output| String::from_utf8_lossy(&output.stdout).contains("ID: uart"))
    }
}
