//! `qemu-system-arm` from version 10 on, whose STM32F405 has a clock controller, and a debugger for itself: the machine's own, or
//! the distribution's, unpacked below the target directory with what they need. Debian 12 has it among its backports.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::{alone, debian, library_folders};

/// The first version that has what is needed.
const OLDEST: u32 = 10;
const PACKAGE: &str = "qemu-system-arm";
/// The debugger without Python, which needs little.
const DEBUGGER: &str = "gdb-minimal";

/// QEMU and a debugger.
pub struct Qemu {
    program: PathBuf,
    debugger: PathBuf,
    /// Where both are unpacked, if they are not the system's.
    roots: [Option<PathBuf>; 2],
}

impl Qemu {
    /// The machine's own, or one that is unpacked below `place`.
    ///
    /// # Errors
    /// What was tried, and what the programs said.
    pub fn get(place: &Path) -> Result<Qemu, String> {
        let (program, qemu) = tool(place, PACKAGE, "usr/bin/qemu-system-arm", |root| {
            debian::unpack_from_backports(root, PACKAGE).or_else(|first| {
                debian::unpack_with_dependencies(root, PACKAGE).map_err(|why| format!("{first}{why}"))
            })
        })?;
        let (debugger, gdb) =
            tool(place, DEBUGGER, "usr/bin/gdb", |root| debian::unpack_with_dependencies(root, DEBUGGER))?;
        Ok(Qemu { program, debugger, roots: [qemu, gdb] })
    }

    /// QEMU with these arguments, under the debugger, which carries out the script at `script`.
    pub fn debugged(&self, script: &Path, arguments: &[String]) -> Command {
        let mut command = Command::new(&self.debugger);
        command.args(["--batch", "--quiet", "-nx", "-x"]).arg(script).arg("--args");
        command.arg(&self.program).args(arguments);
        let folders: Vec<String> = self.roots.iter().flatten().map(|root| library_folders(root)).collect();
        if !folders.is_empty() {
            command.env("LD_LIBRARY_PATH", folders.join(":"));
        }
        command
    }
}

/// The machine's own program, or the one of a package that `unpack` brings.
fn tool(
    place: &Path,
    package: &str,
    path: &str,
    unpack: impl Fn(&Path) -> Result<(), String>,
) -> Result<(PathBuf, Option<PathBuf>), String> {
    let own = Path::new("/").join(path);
    if is_new(&own, None) {
        return Ok((own, None));
    }
    let root = place.join(package);
    let program = root.join(path);
    let _alone = alone(&root)?;
    if !is_new(&program, Some(&root)) {
        unpack(&root)?;
    }
    if is_new(&program, Some(&root)) {
        return Ok((program, Some(root)));
    }
    Err(format!("{package} was unpacked, and does not start, or is older than {OLDEST}\n"))
}

/// Whether a program starts, and is new enough: a debugger of that age would do, too, but there is none in use.
fn is_new(program: &Path, root: Option<&Path>) -> bool {
    let mut command = Command::new(program);
    if let Some(root) = root {
        command.env("LD_LIBRARY_PATH", library_folders(root));
    }
    let said = command.arg("--version").output().map(|output| output.stdout).unwrap_or_default();
    version(&String::from_utf8_lossy(&said)).is_some_and(|version| version >= OLDEST)
}

/// The first number behind a blank in the first line.
fn version(said: &str) -> Option<u32> {
    let words = said.lines().next()?.split(' ');
    words.filter_map(|word| word.split_once('.')?.0.parse().ok()).next()
}

#[cfg(test)]
mod tests {
    use super::version;

    #[test]
    fn versions_are_read() {
        assert_eq!(version("QEMU emulator version 10.0.2 (Debian 1:10.0.2+ds-2)\nCopyright"), Some(10));
        assert_eq!(version("QEMU emulator version 7.2.17 (Debian 1:7.2)"), Some(7));
        assert_eq!(version("GNU gdb (Debian 13.1-3) 13.1"), Some(13));
        assert_eq!(version(""), None);
    }
}
