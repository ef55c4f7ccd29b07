//! Ctrl-C: at the next safe point, not in the middle of a write.

use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex};

use rustix::process::{Pid, Signal, kill_process};

use super::adapter::{Adapter, Faults};
use super::common::CLINO;
use super::server::Server;
use super::{frames, json, patiently, what};

/// Ctrl-C, a request to end, a connection over SSH that breaks.
const SIGNALS: [Signal; 3] = [Signal::INT, Signal::TERM, Signal::HUP];

/// The command, interrupted when it sends this frame: its exit status and its objects.
fn interrupted_at(
    frame: usize,
    sensors: &str,
    baud: u32,
    line: &str,
) -> (Option<i32>, Vec<serde_json::Value>) {
    let pid: Arc<Mutex<Option<Pid>>> = Arc::new(Mutex::new(None));
    let target = Arc::clone(&pid);
    let on_frame = move |number: usize, bytes: &[u8]| {
        if number == frame {
            let signal = SIGNALS[number % SIGNALS.len()];
            kill_process(target.lock().unwrap().expect("it runs"), signal).unwrap();
        }
        bytes.len()
    };
    let adapter =
        Adapter::new(sensors, baud, Faults { on_frame: Some(Box::new(on_frame)), ..Faults::default() });
    let line = format!("{line} --json --latency 80 --port {}", adapter.path());
    let mut guard = pid.lock().unwrap();
    let child = Command::new(CLINO)
        .args(line.split_whitespace())
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    *guard = Some(Pid::from_child(&child));
    drop(guard);
    let output = child.wait_with_output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    (output.status.code(), text.lines().map(|line| serde_json::from_str(line).unwrap()).collect())
}

#[test]
fn a_scan_stops_and_says_that_it_is_not_complete() {
    let server = Server::start("--t7 1 --pty");
    let (status, objects) = interrupted_at(10, &server.path(), 115_200, "t7 scan");
    assert_eq!(status, Some(4), "{objects:?}");
    assert_eq!(what(&objects, "swept")["complete"], false);
    assert!(objects.iter().any(|object| object["hint"]["kind"] == "stopping"), "{objects:?}");
}

#[test]
fn before_the_first_write_nothing_is_written() {
    let server = Server::start("--isu 3,angle=90 --pty");
    let (status, objects) = interrupted_at(3, &server.path(), 9_600, "isu address 3 9 --yes");
    assert_eq!(status, Some(4), "{objects:?}");
    let failed = what(&objects, "failed");
    assert_eq!((&failed["why"], &failed["writes"]), (&"cancelled".into(), &0.into()), "{failed}");
}

#[test]
fn within_the_writes_of_an_isu_the_change_goes_on_to_its_end() {
    // Looks, readings, two writes with their readings, a reset: the last ones.
    let frames = frames("--isu 3,angle=90 --pty", 9_600, "isu address 3 9 --yes");
    let last = frames.saturating_sub(10)..frames;
    let runs: Vec<_> = last.map(|frame| std::thread::spawn(move || isu_interrupted_at(frame))).collect();
    let written: usize = runs.into_iter().map(|run| run.join().unwrap()).sum();
    assert!(written > 0, "none of the frames was within the writes");
}

/// Whether something was written.
fn isu_interrupted_at(frame: usize) -> usize {
    let server = Server::start("--isu 3,angle=90 --pty");
    let port = server.path();
    let (status, objects) = interrupted_at(frame, &port, 9_600, "isu address 3 9 --yes");
    let end = objects.iter().find(|object| object["what"].is_string()).expect("an end");
    let is_written = end["writes"].as_u64().unwrap() > 0;
    let address = match (end["what"].as_str().unwrap(), is_written) {
        ("changed", true) => 9,
        ("failed", false) => 3,
        _ => panic!("interrupted at {frame}: {status:?} {objects:?}"),
    };
    let (_, objects) = patiently(|| match json(&port, &format!("isu info {address}")) {
        (0, objects) => Ok((0, objects)),
        (_, objects) => Err(format!("interrupted at {frame}: {objects:?}")),
    });
    assert_eq!(what(&objects, "identity")["checksum_right"], true, "interrupted at {frame}");
    usize::from(is_written)
}
