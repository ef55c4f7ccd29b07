//! A Python with packages of fixed versions: in a virtual environment, or in a folder where Python has no venv.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::{alone, done};

/// A Python that has the packages.
pub struct Python {
    venv: PathBuf,
    packages: PathBuf,
}

impl Python {
    /// Installs `packages`, each as `name==version`, below `place` if they are not there yet.
    ///
    /// # Errors
    /// What was tried, and what the programs said.
    pub fn with(place: &Path, packages: &[&str]) -> Result<Python, String> {
        let place = place.join(packages.join("-").replace("==", "-"));
        let _alone = alone(&place)?;
        let python = Python { venv: place.join("venv"), packages: place.join("packages") };
        if has(&mut python.command(), packages) {
            return Ok(python);
        }
        let in_venv = python.install_in_venv(packages);
        in_venv.or_else(|venv| {
            // A venv that does not work must not be taken for one that does.
            let _ = std::fs::remove_dir_all(&python.venv);
            python.install(packages).map_err(|why| format!("{venv}{why}"))
        })?;
        if has(&mut python.command(), packages) {
            Ok(python)
        } else {
            Err(format!("{packages:?} were installed, and are not there\n"))
        }
    }

    /// It, without arguments.
    pub fn command(&self) -> Command {
        let in_venv = self.venv.join("bin/python");
        if in_venv.exists() {
            return Command::new(in_venv);
        }
        let mut python = Command::new("python3");
        python.env("PYTHONPATH", &self.packages);
        python
    }

    fn install_in_venv(&self, packages: &[&str]) -> Result<(), String> {
        done(Command::new("python3").args(["-m", "venv", "--clear"]).arg(&self.venv))?;
        done(pip(&mut self.command()).args(packages)).map(drop)
    }

    fn install(&self, packages: &[&str]) -> Result<(), String> {
        done(pip(&mut Command::new("python3")).arg("--target").arg(&self.packages).args(packages)).map(drop)
    }
}

fn pip(python: &mut Command) -> &mut Command {
    python.args(["-m", "pip", "install", "--disable-pip-version-check"])
}

fn has(python: &mut Command, packages: &[&str]) -> bool {
    let check = "import sys, importlib.metadata as m\n\
                 for p in sys.argv[1:]: n, v = p.split('=='); assert m.version(n) == v";
    python.args(["-c", check]).args(packages).output().is_ok_and(|output| output.status.success())
}
