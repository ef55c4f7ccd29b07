//! The tool on a bus, the program itself: against `clino sim --pty`, through adapters of all kinds, over TCP, killed in the
//! middle.
//!
//! Limits of time are generous, because the computer may be busy: the tool is told to allow more for the port, and what has
//! to be found is looked for again.
#![cfg(target_os = "linux")]

mod adapter;
mod asked;
mod commands;
#[path = "../common/mod.rs"]
mod common;
mod documents;
mod gateway;
mod impaired;
mod killed;
mod log;
mod network;
mod numbers;
#[allow(dead_code, reason = "the tests of the simulator use the rest")]
#[path = "../sim/port.rs"]
mod port;
#[allow(dead_code, reason = "the tests of the simulator use the rest")]
#[path = "../sim/server.rs"]
mod server;
mod sniff;
mod stopped;
mod watch;
mod wrong;

use std::time::Duration;

use common::{Run, clino};
use serde_json::Value;

/// What the tool is to allow for a port: a sensor on this computer may be late by that much, in ms.
const LATENCY: &str = "--latency 80";
/// Attempts at what may fail on a busy computer alone.
const ATTEMPTS: usize = 4;
/// After this a T7 that has heard half a command hears again.
const RESYNC: Duration = Duration::from_millis(600);

/// Runs a command on a port.
fn on(port: &str, line: &str) -> Run {
    clino(&format!("{line} --port {port} {LATENCY}"))
}

/// Runs a command on a port for a program; its status and its objects.
fn json(port: &str, line: &str) -> (i32, Vec<Value>) {
    let run = on(port, &format!("{line} --json"));
    assert_eq!(run.stderr, "", "{line}: a program gets everything on standard output");
    (run.status, run.objects().into_iter().map(plain).collect())
}

/// The same with each number as a value: where some other crate has the digits kept, 90.000 is not 90.0.
fn plain(value: Value) -> Value {
    match value {
        Value::Number(number) => match (number.as_i64(), number.as_f64()) {
            (None, Some(float)) => Value::from(float),
            _ => Value::Number(number),
        },
        Value::Array(values) => values.into_iter().map(plain).collect(),
        Value::Object(members) => members.into_iter().map(|(key, value)| (key, plain(value))).collect(),
        other => other,
    }
}

/// The object of that name among those of a run.
fn what<'a>(objects: &'a [Value], name: &str) -> &'a Value {
    let found = objects.iter().find(|object| object["what"] == name);
    found.unwrap_or_else(|| panic!("no {name} in {objects:?}"))
}

/// Does it until it succeeds.
fn patiently<T>(mut attempt: impl FnMut() -> Result<T, String>) -> T {
    let mut last = String::new();
    for _ in 0..ATTEMPTS {
        match attempt() {
            Ok(done) => return done,
            Err(why) => last = why,
        }
        std::thread::sleep(RESYNC);
    }
    panic!("{ATTEMPTS} attempts: {last}");
}

/// Does things that wait most of their time, all at once.
fn together(all: &[&(dyn Fn() + Sync)]) {
    std::thread::scope(|scope| {
        let threads: Vec<_> = all.iter().map(|one| scope.spawn(one)).collect();
        let failed = threads.into_iter().filter_map(|thread| thread.join().err()).last();
        if let Some(why) = failed {
            std::panic::resume_unwind(why);
        }
    });
}

/// How many frames a command sends if it is left alone.
fn frames(sensors: &str, baud: u32, line: &str) -> usize {
    let server = server::Server::start(sensors);
    let adapter = adapter::Adapter::new(&server.path(), baud, adapter::Faults::default());
    let (status, objects) = json(adapter.path(), line);
    assert_eq!(status, 0, "{line}: {objects:?}");
    adapter.frames()
}
