//! The image on the virtual board, in real time, with both ports on pseudo-terminals.

use std::env;
use std::ffi::OsString;
use std::io::{BufRead as _, BufReader, Read as _};
use std::path::Path;
use std::process::{Child, ChildStderr, ChildStdout, Command, Stdio};
use std::thread;

/// A running board.
pub struct Board {
    child: Child,
    output: BufReader<ChildStdout>,
    notes: Option<thread::JoinHandle<String>>,
    /// Where the console is.
    pub console: String,
    /// Where the Modbus port is.
    pub modbus: String,
}

impl Board {
    /// Power on. `name` is the test's own.
    pub fn start(name: &str) -> Board {
        let scenario = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.toml"));
        std::fs::write(&scenario, super::bench::scenario()).expect("the target directory can be written");
        let mut child = command()
            .arg("--scenario")
            .arg(scenario)
            .args(["--realtime", "--console-pty", "--modbus-pty"])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let mut output = BufReader::new(child.stdout.take().expect("piped"));
        let notes = child.stderr.take().map(|stderr| thread::spawn(|| all(stderr)));
        let [console, modbus] = ["console ", "modbus "].map(|port| {
            let mut line = String::new();
            output.read_line(&mut line).expect("a line");
            line.strip_prefix(port).unwrap_or_else(|| panic!("not a {port}: {line:?}")).trim().to_owned()
        });
        Board { child, output, notes, console, modbus }
    }

    /// Ctrl-C, and the board's judgement of the run: no error and no reset of the chip. Returns whether
    /// the run was as fast as real time.
    pub fn stop(mut self) -> bool {
        let id = self.child.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().expect("kill runs").success());
        let mut summary = String::new();
        self.output.read_to_string(&mut summary).expect("text");
        let notes = self.notes.take().and_then(|notes| notes.join().ok()).unwrap_or_default();
        let status = self.child.wait().expect("it ends");
        assert_eq!(status.code(), Some(0), "{summary}\n{notes}");
        assert!(summary.ends_with("All well.\n"), "{summary}\n{notes}");
        assert!(notes.contains("interrupted"), "{notes}");
        !notes.contains("slower than real time")
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        // After `stop` no process is left to kill.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn all(mut stderr: ChildStderr) -> String {
    let mut text = String::new();
    // What cannot be read is missing in a message.
    let _ = stderr.read_to_string(&mut text);
    text
}

/// The virtual board with the image for it; its other arguments are to come.
pub fn command() -> Command {
    let mut command = Command::new(program("CLINO_VBOARD"));
    command.arg("--elf").arg(program("CLINO_ELF")).args(["--board", clino_host_tests::model().name()]);
    command
}

/// The program that this variable names.
pub fn program(variable: &str) -> OsString {
    env::var_os(variable).unwrap_or_else(|| panic!("{variable} is set by `cargo xtask test`"))
}
