//! The tool as a child that is ended with its test.

use std::fs::File;
use std::io::{BufRead as _, BufReader, Read as _};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};

use rustix::process::{Pid, Signal, kill_process};

/// The tool.
pub const CLINO: &str = env!("CARGO_BIN_EXE_clino");

/// A run of `clino bridge` or `clino serve`.
pub struct Program {
    child: Child,
    errors: std::path::PathBuf,
}

impl Program {
    /// Feeds a broker with this configuration.
    pub fn bridge(folder: &Path, configuration: &str) -> Program {
        let file = folder.join("bridge.toml");
        std::fs::write(&file, configuration).expect("a folder of this test");
        Program::start(folder, &["bridge", "--config", &file.display().to_string()])
    }

    /// Starts the tool.
    pub fn start(folder: &Path, arguments: &[&str]) -> Program {
        let mut command = Command::new(CLINO);
        command.args(arguments);
        Program::run(folder, command)
    }

    /// Starts the tool as this command has it.
    pub fn run(folder: &Path, mut command: Command) -> Program {
        let errors = folder.join("stderr");
        let log = File::options().create(true).append(true).open(&errors).expect("a folder of this test");
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(log);
        Program { child: command.spawn().expect("the tool starts"), errors }
    }

    /// The first line that it prints.
    pub fn first_line(&mut self) -> String {
        let mut line = String::new();
        let out = self.child.stdout.as_mut().expect("it is piped");
        BufReader::with_capacity(1, out).read_line(&mut line).expect("text");
        assert!(!line.is_empty(), "it ended: {}", self.errors());
        line.trim_end().to_owned()
    }

    /// What it has said of itself.
    pub fn errors(&self) -> String {
        let mut text = String::new();
        File::open(&self.errors).and_then(|mut file| file.read_to_string(&mut text)).expect("its log");
        text
    }

    /// Its number.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Asks it to end, as a service manager does.
    pub fn end(mut self) -> ExitStatus {
        let pid = Pid::from_child(&self.child);
        kill_process(pid, Signal::TERM).expect("it runs");
        self.child.wait().expect("it was started")
    }

    /// Ends it without a chance.
    pub fn kill(mut self) {
        self.child.kill().expect("it runs");
        self.child.wait().expect("it was started");
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
