//! `libfaketime`, which gives a program another time than the computer's: the machine's own, or the one of its distribution,
//! unpacked below the target directory.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::{alone, debian};

/// Where Debian has it, below `usr/lib` and the folder of the machine.
const LIBRARY: &str = "faketime/libfaketime.so.1";

/// The library.
pub struct Faketime {
    library: PathBuf,
}

impl Faketime {
    /// The machine's own, or one that is unpacked below `place`.
    ///
    /// # Errors
    /// What was tried, and what the programs said.
    pub fn get(place: &Path) -> Result<Faketime, String> {
        if let Some(own) = Faketime::below(Path::new("/")) {
            return Ok(own);
        }
        let root = place.join("faketime");
        let _alone = alone(&root)?;
        if Faketime::below(&root).is_none() {
            debian::unpack(&root, &["libfaketime"])?;
        }
        Faketime::below(&root).ok_or_else(|| "libfaketime was unpacked, and gives no other time\n".to_owned())
    }

    /// One that works.
    fn below(root: &Path) -> Option<Faketime> {
        let machines = std::fs::read_dir(root.join("usr/lib")).ok()?.filter_map(Result::ok);
        let library =
            machines.map(|machine| machine.path().join(LIBRARY)).find(|library| library.exists())?;
        let found = Faketime { library };
        let mut date = Command::new("date");
        date.arg("+%Y").env("LD_PRELOAD", &found.library).env("FAKETIME", "@2001-01-01 00:00:00");
        let output = date.output().ok()?;
        output.stdout.starts_with(b"2001").then_some(found)
    }

    /// Gives a program the computer's time plus the seconds that this file says at each look (`+3600`). The clock that does
    /// not jump stays as it is.
    pub fn apply(&self, command: &mut Command, clock: &Path) {
        command
            .env("LD_PRELOAD", &self.library)
            .env("FAKETIME_TIMESTAMP_FILE", clock)
            .env("FAKETIME_NO_CACHE", "1")
            .env("FAKETIME_DONT_FAKE_MONOTONIC", "1")
            .env("DONT_FAKE_MONOTONIC", "1");
    }
}
