//! `prometheus` and `influxd`, as the distribution has them: the machine's own, or unpacked below the target directory.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::{alone, debian};

/// A program of a package of its own, which needs nothing else.
pub struct Monitor {
    program: PathBuf,
}

impl Monitor {
    /// Prometheus, version 2.
    ///
    /// # Errors
    /// What was tried, and what the programs said.
    pub fn prometheus(place: &Path) -> Result<Monitor, String> {
        Monitor::get(place, "prometheus", "prometheus", &["--version"])
    }

    /// InfluxDB, version 1.
    ///
    /// # Errors
    /// What was tried, and what the programs said.
    pub fn influxd(place: &Path) -> Result<Monitor, String> {
        Monitor::get(place, "influxdb", "influxd", &["version"])
    }

    fn get(place: &Path, package: &str, name: &str, asks_version: &[&str]) -> Result<Monitor, String> {
        let works = |program: &Path| {
            let mut command = Command::new(program);
            let quiet =
                command.args(asks_version).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
            quiet.status().is_ok_and(|status| status.success())
        };
        let own = Path::new("/usr/bin").join(name);
        if works(&own) {
            return Ok(Monitor { program: own });
        }
        let root = place.join(package);
        let _alone = alone(&root)?;
        let program = root.join("usr/bin").join(name);
        if !works(&program) {
            debian::unpack(&root, &[package])?;
        }
        if works(&program) {
            Ok(Monitor { program })
        } else {
            Err(format!("{package} was unpacked, and does not start\n"))
        }
    }

    /// It, without arguments.
    pub fn command(&self) -> Command {
        Command::new(&self.program)
    }
}
