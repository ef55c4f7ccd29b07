//! A `clino sim` that runs.

use std::io::{BufRead as _, BufReader, Read as _};
use std::process::{Child, Command, Stdio};
use std::sync::Mutex;
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::Duration;

pub use rustix::process::Signal;
use rustix::process::{Pid, kill_process};

/// The tool.
pub const CLINO: &str = env!("CARGO_BIN_EXE_clino");

/// Longest wait for something that must come.
pub const PATIENCE: Duration = Duration::from_secs(30);

/// A simulator, ended with the test.
pub struct Server {
    child: Mutex<Child>,
    lines: Receiver<String>,
}

impl Server {
    /// Starts `clino sim` with the rest of the command line, split at blanks.
    pub fn start(line: &str) -> Self {
        let mut child = Command::new(CLINO)
            .arg("sim")
            .args(line.split_whitespace())
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let output = BufReader::new(child.stdout.take().unwrap());
        let (sender, lines) = channel();
        thread::spawn(move || output.lines().map_while(Result::ok).try_for_each(|line| sender.send(line)));
        Self { child: Mutex::new(child), lines }
    }

    /// The next line on standard output.
    pub fn path(&self) -> String {
        self.lines.recv_timeout(PATIENCE).expect("a line on standard output")
    }

    /// Asks it to end; its exit status, and the lines not yet read.
    pub fn stop(self, signal: Signal) -> (Option<i32>, Vec<String>) {
        let mut child = self.child.lock().unwrap();
        kill_process(Pid::from_child(&child), signal).unwrap();
        let status = child.wait().unwrap();
        (status.code(), self.lines.iter().collect())
    }

    /// Asks it to end; what it has written to standard error.
    pub fn notes(self) -> String {
        let mut child = self.child.lock().unwrap();
        kill_process(Pid::from_child(&child), Signal::TERM).unwrap();
        let mut notes = String::new();
        child.stderr.take().unwrap().read_to_string(&mut notes).unwrap();
        assert_eq!(child.wait().unwrap().code(), Some(0));
        notes
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let mut child = self.child.lock().unwrap();
        // After `stop` no process is left to kill.
        let _ = child.kill();
        let _ = child.wait();
    }
}
