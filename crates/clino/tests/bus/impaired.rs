//! Through adapters as they are: what they do to the bytes is survived, and no setting is left half done.

use std::io::Read as _;
use std::process::{Child, Command, Output, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

use super::adapter::{Adapter, Faults};
use super::common::CLINO;
use super::server::Server;
use super::{json, on, patiently, together};

const T7_BAUD: u32 = 115_200;
const ISU_BAUD: u32 = 9_600;

/// Reads and sets up a T7 and an ISU through adapters that do this.
fn survives(name: &str, t7_faults: impl Fn() -> Faults + Sync, isu_faults: impl Fn() -> Faults + Sync) {
    let t7 = || {
        let server = Server::start("--t7 5,angle=-0.255,serial=77,damping=20 --pty");
        let adapter = Adapter::new(&server.path(), T7_BAUD, t7_faults());
        let step = |line: &str, expected: &str, is_done: &dyn Fn() -> bool| {
            step(name, &adapter, line, expected, is_done)
        };
        let nothing = || false;
        step("t7 angle 5", "angle", &nothing);
        step("t7 info 5", "identity", &nothing);
        step("t7 damping 5 30 --yes", "changed", &nothing);
        step("t7 zero 5 --yes", "zeroed", &nothing);
        step("t7 address 5 6 --yes", "changed", &|| json(adapter.path(), "t7 angle 6").0 == 0);
        let identity = step("t7 info 6", "identity", &nothing).expect("it is read");
        let named = ["serial", "damping_ms", "offset_2_mdeg"].map(|name| identity[name].clone());
        assert_eq!(named, [77, 30, 255].map(Value::from), "{name}");
    };
    let isu = || {
        let server = Server::start("--isu 3,angle=90 --pty");
        let adapter = Adapter::new(&server.path(), ISU_BAUD, isu_faults());
        let moved = || {
            json(adapter.path(), "isu repair 3 4 --yes").0 == 0 && json(adapter.path(), "isu angle 4").0 == 0
        };
        step(name, &adapter, "isu angle 3", "angle", &|| false);
        step(name, &adapter, "isu address 3 4 --yes", "changed", &moved);
        let identity = step(name, &adapter, "isu info 4", "identity", &|| false).expect("it is read");
        assert_eq!(
            (&identity["checksum_right"], &identity["angle_deg"]),
            (&true.into(), &90.0.into()),
            "{name}"
        );
    };
    together(&[&t7, &isu]);
}

/// A command that succeeds in the end; what it told then. What failed late may have been done all the same, by an earlier
/// attempt, too.
fn step(
    name: &str,
    adapter: &Adapter,
    line: &str,
    expected: &str,
    is_done: &dyn Fn() -> bool,
) -> Option<Value> {
    patiently(|| {
        let (status, objects) = json(adapter.path(), line);
        let told = objects.iter().find(|object| object["what"] == expected || object["what"] == "unchanged");
        match (status, told) {
            (0, Some(told)) => Ok(Some(told.clone())),
            _ if is_done() => Ok(None),
            _ => Err(format!("{name}, {line}: {status} {objects:?}")),
        }
    })
}

#[test]
fn adapters_as_they_are_are_survived() {
    let millis = Duration::from_millis;
    let batches = || Faults { batch: millis(16), ..Faults::default() };
    let fragments = || Faults { fragment: millis(1), ..Faults::default() };
    let echo = || Faults { echo: true, batch: millis(16), ..Faults::default() };
    let lost = |drop_every| move || Faults { drop_every, ..Faults::default() };
    let doubled = |double_every| move || Faults { double_every, ..Faults::default() };
    together(&[
        &|| survives("batches of 16 ms", batches, batches),
        &|| survives("fragments of a byte each ms", fragments, fragments),
        &|| survives("an echo in batches", echo, echo),
        // An ISU's longest answer has 35 bytes, and each that is lost costs the 400 ms until the module forgets a command.
        &|| survives("lost bytes", lost(61), lost(211)),
        &|| survives("doubled bytes", doubled(61), doubled(211)),
    ]);
}

#[test]
fn a_scan_through_batches_finds_every_sensor() {
    let server = Server::start("--t7 1 --t7 2 --t7 64 --t7 127 --pty");
    let faults = Faults { batch: Duration::from_millis(16), ..Faults::default() };
    let adapter = Adapter::new(&server.path(), T7_BAUD, faults);
    // As it is: the usual allowance is made for such adapters.
    patiently(|| {
        let run = super::clino(&format!("t7 scan --json --port {}", adapter.path()));
        let found = run.objects().iter().filter(|object| object["what"] == "found").count();
        if (run.status, found) == (0, 4) { Ok(()) } else { Err(format!("{run:?}")) }
    });
}

#[test]
fn an_adapter_unplugged_in_the_middle_is_an_error_with_a_next_step() {
    for (line, flag) in [("t7 info 5", ""), ("t7 info 5", " --json")] {
        let server = Server::start("--t7 5 --pty");
        let adapter = Adapter::new(&server.path(), T7_BAUD, Faults { unplug_after: 30, ..Faults::default() });
        let run = on(adapter.path(), &format!("{line}{flag}"));
        assert_eq!(run.status, 3, "{run:?}");
        if flag.is_empty() {
            assert_eq!(run.stdout, "", "{run:?}");
            assert!(run.stderr.contains("has vanished\n  next: check the plug"), "{run:?}");
        } else {
            let error = &run.objects()[0]["error"];
            assert_eq!((&error["kind"], run.stderr.as_str()), (&"port_vanished".into(), ""), "{run:?}");
        }
    }
}

/// A computer that stands still again and again, longer than any sensor may take.
#[test]
fn a_computer_that_stands_still_takes_no_good_answer_for_a_late_one() {
    let server = Server::start("--t7 5,angle=-0.255,serial=77 --pty");
    let port = server.path();
    for line in ["t7 info 5", "t7 damping 5 30 --yes", "t7 offset 5 100 --yes", "t7 angle 5"] {
        // As it is, without more allowed to the port.
        let line = format!("{line} --json --port {port}");
        let child = Command::new(CLINO)
            .args(line.split_whitespace())
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let pid = Pid::from_child(&child);
        let is_over = AtomicBool::new(false);
        let output = thread::scope(|scope| {
            scope.spawn(|| {
                while !is_over.load(Ordering::SeqCst) {
                    for (signal, span) in [(Signal::STOP, 60), (Signal::CONT, 3)] {
                        // It may have ended just now; its number is kept until it is waited for.
                        let _ = kill_process(pid, signal);
                        thread::sleep(Duration::from_millis(span));
                    }
                }
            });
            let output = waited_for(child, &is_over);
            is_over.store(true, Ordering::SeqCst);
            output
        });
        let said = String::from_utf8_lossy(&output.stdout);
        assert_eq!(output.status.code(), Some(0), "{line}: {said}");
    }
}

/// Reads what a program says to its end; then nothing more is sent to it, and it is waited for.
fn waited_for(mut child: Child, is_over: &AtomicBool) -> Output {
    let mut stdout = Vec::new();
    child.stdout.take().unwrap().read_to_end(&mut stdout).unwrap();
    is_over.store(true, Ordering::SeqCst);
    let _ = kill_process(Pid::from_child(&child), Signal::CONT);
    Output { stdout, ..child.wait_with_output().unwrap() }
}

/// Readings go on through adapters as they are, none of them wrong.
#[test]
fn readings_through_bad_adapters_are_right_or_have_a_status() {
    let server = || Server::start("--t7 5,angle=12.345 --pty");
    let millis = Duration::from_millis;
    let cases = [
        ("batches", Faults { batch: millis(16), ..Faults::default() }),
        ("fragments", Faults { fragment: millis(1), ..Faults::default() }),
        ("echo", Faults { echo: true, ..Faults::default() }),
        ("lost", Faults { drop_every: 13, ..Faults::default() }),
        ("doubled", Faults { double_every: 13, ..Faults::default() }),
    ];
    thread::scope(|scope| {
        for (name, faults) in cases {
            scope.spawn(move || {
                let server = server();
                let adapter = Adapter::new(&server.path(), T7_BAUD, faults);
                let line = format!("4 {CLINO} watch t7 5 --json --latency 80 --port {}", adapter.path());
                let output =
                    Command::new("timeout").args(["-s", "INT"]).args(line.split(' ')).output().unwrap();
                let said = String::from_utf8(output.stdout).unwrap();
                let readings: Vec<Value> =
                    said.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
                let good = readings.iter().filter(|reading| reading["status"] == "ok");
                assert!(good.clone().count() > 5, "{name}: {said}");
                assert!(
                    good.clone().all(|reading| super::plain(reading["angle_deg"].clone()) == 12.345),
                    "{name}: {said}"
                );
            });
        }
    });
}
