//! Running other programs, and what to say when they fail.

use std::env;
use std::fmt;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Why a task did not succeed.
#[derive(Debug)]
pub struct Failure {
    /// What happened, and what to do about it.
    pub message: String,
    /// Exit status of `cargo xtask`.
    pub status: u8,
}

impl Failure {
    /// A failure with exit status 1.
    pub fn new(message: impl Into<String>) -> Failure {
        Failure { message: message.into(), status: 1 }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

/// Result of a task.
pub type Outcome = Result<(), Failure>;

/// `cargo`, the one that runs us, in the workspace's root.
pub fn cargo<'a>(arguments: impl IntoIterator<Item = &'a str>) -> Command {
    let mut command = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.args(arguments).current_dir(root());
    command
}

/// The folder of the workspace's `Cargo.toml`.
pub fn root() -> PathBuf {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    manifest.parent().unwrap_or(manifest).to_path_buf()
}

/// Where cargo puts what it builds.
pub fn target_dir() -> PathBuf {
    env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), |folder| root().join(folder))
}

/// A command line as one would type it.
pub fn shown(command: &Command) -> String {
    let shown = format!("{command:?}").replace('"', "");
    shown.rsplit_once("/cargo ").map_or(shown.clone(), |(_, rest)| format!("cargo {rest}"))
}

/// Runs a program to its end, showing what it prints.
pub fn run(mut command: Command) -> Outcome {
    let shown = shown(&command);
    eprintln!("$ {shown}");
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(Failure {
            message: format!("`{shown}` failed: {status}"),
            status: status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(1),
        }),
        Err(error) => Err(Failure::new(format!("`{shown}` could not be started: {error}"))),
    }
}

/// A script of the repository, which builds below our target directory.
pub fn script(path: &str, arguments: &[&str]) -> Command {
    let mut script = Command::new("sh");
    script.arg(path).args(arguments).current_dir(root());
    script.env("CARGO_TARGET_DIR", target_dir());
    script
}

/// Standard output of a program that succeeds, or `None`.
pub fn output_of(program: &str, arguments: &[&str]) -> Option<String> {
    let output = Command::new(program).args(arguments).current_dir(root()).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).into_owned())
}

/// Becomes another program: it gets the terminal's signals itself, and its exit status is ours.
#[cfg(unix)]
pub fn become_it(mut command: Command) -> Outcome {
    use std::os::unix::process::CommandExt;
    let error = command.exec();
    Err(Failure::new(format!("`{command:?}` could not be started: {error}")))
}

/// Runs another program to its end; its exit status is ours.
#[cfg(not(unix))]
pub fn become_it(command: Command) -> Outcome {
    run(command)
}
