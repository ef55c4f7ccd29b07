//! `mosquitto`, an MQTT broker, and its clients: the machine's own, or those of its distribution, unpacked below the target
//! directory.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::{alone, debian};

/// It, its clients, and the libraries they are linked to that a Debian need not have.
const PACKAGES: [&str; 6] =
    ["mosquitto", "mosquitto-clients", "libmosquitto1", "libcjson1", "libdlt2", "libwrap0"];

/// A broker with its clients, version 2.
pub struct Mosquitto {
    /// Where it was unpacked, if it is not the system's.
    root: Option<PathBuf>,
}

impl Mosquitto {
    /// The machine's own, or one that is unpacked below `place`.
    ///
    /// # Errors
    /// What was tried, and what the programs said.
    pub fn get(place: &Path) -> Result<Mosquitto, String> {
        let own = Mosquitto { root: None };
        if own.works() {
            return Ok(own);
        }
        let root = place.join("mosquitto");
        let _alone = alone(&root)?;
        let unpacked = Mosquitto { root: Some(root.clone()) };
        if unpacked.works() {
            return Ok(unpacked);
        }
        debian::unpack(&root, &PACKAGES)?;
        if unpacked.works() {
            Ok(unpacked)
        } else {
            Err("mosquitto was unpacked, and does not start\n".to_owned())
        }
    }

    /// The broker, without arguments.
    pub fn broker(&self) -> Command {
        self.command("usr/sbin/mosquitto")
    }

    /// The client that prints what it has subscribed to, without arguments.
    pub fn subscriber(&self) -> Command {
        self.command("usr/bin/mosquitto_sub")
    }

    /// The client that publishes, without arguments.
    pub fn publisher(&self) -> Command {
        self.command("usr/bin/mosquitto_pub")
    }

    /// What makes files of passwords, without arguments.
    pub fn passwords(&self) -> Command {
        self.command("usr/bin/mosquitto_passwd")
    }

    fn command(&self, program: &str) -> Command {
        let Some(root) = &self.root else { return Command::new(Path::new("/").join(program)) };
        let mut command = Command::new(root.join(program));
        let folders = super::library_folders(root);
        command.env("LD_LIBRARY_PATH", folders);
        command
    }

    fn works(&self) -> bool {
        let quiet = |command: &mut Command| {
            let said = command.stdin(Stdio::null()).output();
            said.map(|output| String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned())
        };
        quiet(self.broker().arg("-h")).is_ok_and(|text| text.contains("mosquitto version 2"))
            && quiet(self.subscriber().arg("--help")).is_ok_and(|text| text.contains("mosquitto_sub"))
    }
}
