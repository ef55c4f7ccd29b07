//! Running the tool, and reading what it says.
#![allow(dead_code, reason = "every test program uses another part")]

use std::io::Write as _;
use std::process::{Command, Output, Stdio};
use std::thread;

use serde_json::Value;

/// The tool, as it was built with the tests.
pub const CLINO: &str = env!("CARGO_BIN_EXE_clino");

/// The tool that is measured: `CLINO_TOOL`, of another build, or that of the tests.
pub fn measured() -> String {
    std::env::var("CLINO_TOOL").unwrap_or_else(|_| CLINO.to_owned())
}

/// What a run left behind.
#[derive(Debug)]
pub struct Run {
    pub status: i32,
    pub stdout: String,
    pub stderr: String,
}

impl Run {
    fn new(output: Output) -> Self {
        Self {
            status: output.status.code().expect("the tool is not killed"),
            stdout: String::from_utf8(output.stdout).unwrap(),
            stderr: String::from_utf8(output.stderr).unwrap(),
        }
    }

    /// The objects on standard output, one per line.
    pub fn objects(&self) -> Vec<Value> {
        self.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    }
}

/// Splits a command line at blanks, and runs it.
pub fn clino(line: &str) -> Run {
    run(CLINO, line)
}

/// The same with this build of the tool.
pub fn run(tool: &str, line: &str) -> Run {
    let output = Command::new(tool).args(line.split_whitespace()).stdin(Stdio::null()).output();
    Run::new(output.unwrap())
}

/// As [`clino`], with that on standard input.
pub fn fed(line: &str, input: impl Into<Vec<u8>>) -> Run {
    let mut child = Command::new(CLINO)
        .args(line.split_whitespace())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let input = input.into();
    let feeder = thread::spawn(move || stdin.write_all(&input));
    let output = child.wait_with_output().unwrap();
    feeder.join().unwrap().unwrap();
    Run::new(output)
}

/// The one object of a good frame.
pub fn good(line: &str) -> Value {
    let run = clino(line);
    assert_eq!((run.status, run.stderr.as_str()), (0, ""), "{line}: {run:?}");
    let mut objects = run.objects();
    assert_eq!(objects.len(), 1, "{line}: {run:?}");
    objects.remove(0)
}

/// The error of a bad frame.
pub fn bad(line: &str) -> Value {
    let run = clino(line);
    assert_eq!((run.status, run.stderr.as_str()), (1, ""), "{line}: {run:?}");
    let mut objects = run.objects();
    assert_eq!(objects.len(), 1, "{line}: {run:?}");
    let mut object = objects.remove(0);
    assert_eq!(object.as_object().unwrap().len(), 1, "{object}");
    object["error"].take()
}

/// The frame that an `encode` prints.
pub fn encoded(line: &str) -> String {
    let run = clino(line);
    assert_eq!((run.status, run.stderr.as_str()), (0, ""), "{line}: {run:?}");
    run.stdout.strip_suffix('\n').expect("a line").to_owned()
}

/// The message for bad usage, on standard error only.
pub fn misused(line: &str) -> String {
    let run = clino(line);
    assert_eq!((run.status, run.stdout.as_str()), (2, ""), "{line}: {run:?}");
    run.stderr
}

/// Asserts that `object` has everything that `part` has.
pub fn assert_has(object: &Value, part: &Value, context: &str) {
    for (name, value) in part.as_object().expect("an object") {
        assert_eq!(object.get(name), Some(value), "{name} in {object} for {context}");
    }
}

/// Every worked example of the two documents, of one protocol.
pub fn vectors(protocol: &str) -> Vec<Value> {
    let all = include_str!("../../../codec/tests/vectors/documented.jsonl");
    all.lines()
        .map(|line| serde_json::from_str::<Value>(line).unwrap())
        .filter(|vector| vector["protocol"] == protocol)
        .collect()
}

/// A T7 frame, made here from its description: all bytes together sum to zero.
pub fn t7_frame(body: &[u8]) -> String {
    let sum = body.iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte));
    text(&[body, &[0_u8.wrapping_sub(sum)]].concat())
}

/// An ISU frame, made here from its description: the plain sum of all bytes but the first.
pub fn isu_frame(body: &[u8]) -> String {
    let sum = body[1..].iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte));
    text(&[body, &[sum]].concat())
}

pub fn text(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(" ")
}
