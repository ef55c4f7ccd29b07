//! A `clino sim` that runs.
//!
//! *Numbers of terminals.* The system gives the number of a terminal that is gone to the next one, which may be another test's
//! at the same time: a program that opens its port again would then be on that test's bus. A number is kept for as long as
//! some program has that terminal open, so the test opens each before its simulator ends, and never closes it.

use std::fs::File;
use std::io::{BufRead as _, BufReader, Read as _};
use std::os::unix::fs::OpenOptionsExt as _;
use std::process::{Child, Command, Stdio};
use std::sync::Mutex;
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::Duration;

use rustix::fs::OFlags;
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
    terminals: Mutex<Vec<String>>,
}

/// Keeps the number of this terminal from any other one until the test's process ends.
pub fn keep_number(terminal: &str) {
    let flags = (OFlags::NOCTTY | OFlags::NONBLOCK).bits().cast_signed();
    // It may be no terminal, or gone.
    if let Ok(file) = File::options().read(true).write(true).custom_flags(flags).open(terminal) {
        std::mem::forget(file);
    }
}

impl Server {
    /// Starts `clino sim` with the rest of the command line, split at blanks.
    pub fn start(line: &str) -> Self {
        Self::of(CLINO, line)
    }

    /// The same with this build of the tool.
    pub fn of(tool: &str, line: &str) -> Self {
        let mut child = Command::new(tool)
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
        Self { child: Mutex::new(child), lines, terminals: Mutex::default() }
    }

    /// The next line on standard output.
    pub fn path(&self) -> String {
        let line = self.lines.recv_timeout(PATIENCE).expect("a line on standard output");
        self.terminals.lock().unwrap().push(line.clone());
        line
    }

    fn keep_numbers(&self) {
        self.terminals.lock().unwrap().drain(..).for_each(|terminal| keep_number(&terminal));
    }

    /// Asks it to end; its exit status, and the lines not yet read.
    pub fn stop(self, signal: Signal) -> (Option<i32>, Vec<String>) {
        self.keep_numbers();
        let mut child = self.child.lock().unwrap();
        kill_process(Pid::from_child(&child), signal).unwrap();
        let status = child.wait().unwrap();
        (status.code(), self.lines.iter().collect())
    }

    /// Asks it to end; what it has written to standard error.
    pub fn notes(self) -> String {
        self.keep_numbers();
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
        self.keep_numbers();
        let mut child = self.child.lock().unwrap();
        // After `stop` no process is left to kill.
        let _ = child.kill();
        let _ = child.wait();
    }
}
