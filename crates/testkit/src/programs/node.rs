//! A Node.js with packages of fixed versions, in a folder of their own.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::done;

/// A Node.js that has the packages.
pub struct Node {
    modules: PathBuf,
}

impl Node {
    /// Installs `packages`, each as `name@version`, below `place` if they are not there yet. Tests of one program that run
    /// at the same time must not call this at the same time for the same packages.
    ///
    /// # Errors
    /// What was tried, and what the programs said.
    pub fn with(place: &Path, packages: &[&str]) -> Result<Node, String> {
        let place = place.join(packages.join("-").replace('@', "-"));
        let node = Node { modules: place.join("node_modules") };
        if node.has(packages) {
            return Ok(node);
        }
        let npm = ["install", "--no-audit", "--no-fund", "--no-save", "--prefix"];
        done(Command::new("npm").args(npm).arg(&place).args(packages))?;
        if node.has(packages) {
            Ok(node)
        } else {
            Err(format!("{packages:?} were installed, and are not there\n"))
        }
    }

    /// It, without arguments.
    pub fn command(&self) -> Command {
        let mut node = Command::new("node");
        node.env("NODE_PATH", &self.modules);
        node
    }

    /// The folder of a package.
    pub fn module(&self, name: &str) -> PathBuf {
        self.modules.join(name)
    }

    fn has(&self, packages: &[&str]) -> bool {
        let check = "for (const p of process.argv.slice(1)) {\n\
                     const [n, v] = p.split('@'); require(n); \
                     if (require(`${process.env.NODE_PATH}/${n}/package.json`).version !== v) process.exit(1);\n}";
        self.command().args(["-e", check]).args(packages).output().is_ok_and(|output| output.status.success())
    }
}
