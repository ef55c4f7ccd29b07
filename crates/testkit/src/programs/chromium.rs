//! Chromium without a window: the machine's own, or the distribution's, installed where that is allowed. It has too many
//! libraries to be unpacked.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::{alone, done};

/// A browser.
pub struct Chromium {
    /// Its program.
    pub program: PathBuf,
}

impl Chromium {
    /// The machine's own, or the distribution's; `place` is for a lock.
    ///
    /// # Errors
    /// What was tried, and what the programs said.
    pub fn get(place: &Path) -> Result<Chromium, String> {
        if let Some(own) = Chromium::own() {
            return Ok(own);
        }
        let _alone = alone(&place.join("chromium"))?;
        if let Some(own) = Chromium::own() {
            return Ok(own);
        }
        let install = || {
            let mut apt = Command::new("apt-get");
            apt.args(["install", "--yes", "--no-install-recommends", "chromium"])
                .env("DEBIAN_FRONTEND", "noninteractive");
            done(&mut apt)
        };
        install().or_else(|first| {
            let updated = done(Command::new("apt-get").arg("update"));
            updated.and_then(|_| install()).map_err(|second| format!("{first}{second}"))
        })?;
        Chromium::own().ok_or_else(|| "chromium was installed, and is not there\n".to_owned())
    }

    fn own() -> Option<Chromium> {
        let programs = ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];
        let program = programs.into_iter().map(PathBuf::from).find(|program| program.exists())?;
        Some(Chromium { program })
    }
}
