//! What goes wrong at a bench: each is a message with the probable cause and the next step, and an exit status.

use std::fs::File;
use std::os::fd::AsFd as _;

use rustix::fs::{FlockOperation, flock};

use super::adapter::{Adapter, Faults};
use super::common::misused;
use super::port::Port;
use super::server::Server;
use super::{LATENCY, clino, json, on, patiently, together};

/// What a command says for people and for programs, when its port cannot be used.
fn port_error(port: &str, options: &str, kind: &str, next: &str) {
    let (status, objects) = json(port, &format!("t7 angle 5 {options}"));
    let error = &objects[0]["error"];
    assert_eq!((status, &error["kind"], &error["port"]), (3, &kind.into(), &port.into()), "{objects:?}");
    let run = on(port, &format!("t7 angle 5 {options}"));
    assert_eq!((run.status, run.stdout.as_str()), (3, ""), "{run:?}");
    assert!(run.stderr.contains("next: ") && run.stderr.contains(next), "{run:?}");
}

#[test]
fn a_port_that_cannot_be_used() {
    let server = Server::start("--t7 5 --pty");
    let port = server.path();
    port_error("/dev/there-is-no-such-port", "", "port_missing", "clino ports");
    port_error("/dev/null", "", "not_a_port", "clino ports");
    port_error("/dev", "", "not_a_port", "clino ports");
    port_error(&port, "--rs485", "no_rs485", "leave --rs485 out");
    port_error(&port, "--rts-de", "no_rts", "leave --rts-de out");
    // After all that it works.
    assert_eq!(on(&port, "t7 angle 5").status, 0);
}

/// A single-axis T7 answers zero for the axes that it does not have: that is neither an angle nor a setting.
#[test]
fn an_axis_that_a_t7_does_not_have() {
    let server = Server::start("--t7 5 --pty");
    let port = server.path();
    for axis in [0, 1] {
        for command in ["angle 5", "zero 5 --yes", "offset 5 0 --yes", "direction 5 normal --yes"] {
            let (status, objects) = json(&port, &format!("t7 {command} -a {axis}"));
            let text = format!("{objects:?}");
            assert!(status == 1 && text.contains("no_such_axis"), "{command} -a {axis}: {status}, {text}");
        }
    }
}

#[test]
fn a_port_that_another_program_has() {
    let server = Server::start("--t7 5 --pty");
    let port = server.path();
    let other = File::options().read(true).write(true).open(&port).unwrap();
    flock(other.as_fd(), FlockOperation::LockExclusive).unwrap();
    port_error(&port, "", "port_busy", "end the other program");
    drop(other);
    assert_eq!(on(&port, "t7 angle 5").status, 0);
}

#[test]
fn a_port_is_left_as_it_was_found() {
    let server = Server::start("--t7 5,baud=9600,angle=-0.001 --pty");
    let port = server.path();
    let found = || {
        let attributes = Port::open(&port).attributes();
        let modes = (attributes.input_modes, attributes.output_modes, attributes.control_modes);
        (modes, attributes.local_modes, attributes.output_speed())
    };
    let before = found();
    let run = on(&port, "t7 angle 5 --baud 9600");
    assert_eq!(run.stdout, "angle: address 5, axis 2, angle_deg -0.001\n", "{run:?}");
    assert_eq!(found(), before);
    assert_eq!(on(&port, "t7 angle 6 --baud 9600").status, 1);
    assert_eq!(found(), before);
}

#[test]
fn two_of_us_do_not_share_a_port() {
    let server = Server::start("--t7 1 --pty");
    let adapter = Adapter::new(&server.path(), 115_200, Faults::default());
    let line = format!("t7 scan --port {} {LATENCY}", adapter.path());
    let scan = std::thread::spawn(move || clino(&line));
    while adapter.frames() == 0 {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    // It has the port for the 8 s that 101 addresses take.
    let (status, objects) = json(adapter.path(), "t7 angle 1");
    assert_eq!((status, &objects[0]["error"]["kind"]), (3, &"port_busy".into()), "{objects:?}");
    drop(adapter);
    // What had it has noticed that it is gone.
    assert_eq!(scan.join().unwrap().status, 3);
}

/// A program is told a probable cause of this kind; people are told it, too, with steps in order, this one among them. On a
/// busy computer what is seen may lead to another cause now and then.
fn cause(port: &str, line: &str, step: &str, kind: &str) {
    patiently(|| {
        // Silence is silence: no more is allowed than usual.
        let run = clino(&format!("{line} --json --port {port}"));
        let objects = run.objects();
        let hints: Vec<_> = objects.iter().map(|object| &object["hint"]).collect();
        let is_named = hints.iter().any(|hint| hint["kind"] == kind && hint["next"].is_array());
        if run.status == 1 && is_named { Ok(()) } else { Err(format!("{line}, {kind}: {run:?}")) }
    });
    patiently(|| {
        let run = clino(&format!("{line} --port {port}"));
        let parts = ["probable cause: ", "\n  1. ", step];
        let is_told = parts.iter().all(|part| run.stderr.contains(part));
        if run.status == 1 && is_told { Ok(()) } else { Err(format!("{line}, {step}: {run:?}")) }
    });
}

#[test]
fn no_sensor_answers() {
    let server = Server::start("--t7 5 --isu 3 --pty");
    let [t7, isu] = [0, 1].map(|_| server.path());
    let asks_t7 = || {
        cause(&t7, "t7 angle 6", "clino t7 scan;", "silence");
        cause(&t7, "t7 damping 6 500 --yes", "check the supply", "silence");
        // At a wrong rate a sensor understands nothing: the sweep is offered.
        cause(&t7, "t7 angle 5 --baud 19200", "clino t7 scan all", "silence");
        // And it is understood at once at its own, although it is deaf for half a second.
        assert_eq!(on(&t7, "t7 angle 5").status, 0);
    };
    let asks_isu = || cause(&isu, "isu angle 4", "TXEN switches its driver", "silence");
    together(&[&asks_t7, &asks_isu]);
}

#[test]
fn an_empty_bus_is_scanned() {
    let server = Server::start("--isu 3 --pty");
    let run = clino(&format!("t7 scan --port {} --latency 10", server.path()));
    assert_eq!(
        (run.status, run.stdout.as_str()),
        (1, "swept: devices 0, suspects 0, asked 101, complete yes\n"),
        "{run:?}"
    );
    assert!(run.stderr.contains("probable cause: no sensor answers"), "{run:?}");
}

#[test]
fn an_echo_that_was_not_expected_and_one_that_is_missing() {
    let server = Server::start("--t7 5 --pty");
    let port = server.path();
    let adapter = Adapter::new(&port, 115_200, Faults { echo: true, ..Faults::default() });
    cause(adapter.path(), "t7 angle 6 --echo off", "leave --echo out", "echo");
    // It is found out, and there is only silence behind it.
    cause(adapter.path(), "t7 angle 6", "check the supply", "silence");
    assert_eq!(on(adapter.path(), "t7 angle 5 --echo expected").status, 0);
    drop(adapter);
    cause(&port, "t7 angle 5 --echo expected", "leave --echo out", "no_echo");
}

#[test]
fn answers_that_are_later_than_the_port_is_allowed() {
    let server = Server::start("--t7 5,angle=12.345,fault=late:50ms/1 --pty");
    let port = server.path();
    // On a busy computer an answer may be so late that it passes for that to the next try, which it is as well.
    cause(&port, "t7 angle 5", "1. allow more, such as --latency 100", "late");
    // What is advised works, with room for a busy computer.
    let run = clino(&format!("t7 angle 5 --port {port} --latency 300"));
    assert_eq!(run.stdout, "angle: address 5, axis 2, angle_deg 12.345\n", "{run:?}");
}

#[test]
fn two_sensors_at_one_address() {
    // Chance decides each bit, so that now and then one of them wins: then there is no error to be told.
    let server = Server::start("--t7 127,serial=25033 --t7 127,serial=2863311530,model=t7-3 --pty");
    let port = server.path();
    patiently(|| {
        let (_, objects) = json(&port, "t7 info 127");
        let hint = objects.iter().map(|object| &object["hint"]["kind"]).find(|kind| kind.is_string());
        match hint {
            Some(kind) if kind == "collision" => Ok(()),
            _ => Err(format!("{objects:?}")),
        }
    });
    let run = patiently(|| {
        let run = clino(&format!("t7 scan --port {port} --latency 15"));
        if run.stdout.contains("suspect: address 127, baud 115200") {
            Ok(run)
        } else {
            Err(format!("{run:?}"))
        }
    });
    assert!(
        run.stderr.contains("connect one sensor alone: factory-fresh T7s all have address 127"),
        "{run:?}"
    );
}

#[test]
fn words_that_make_no_sense() {
    for (line, part) in [
        ("t7 angle 5", "--port"),
        ("t7 angle 126 --port x", "1 to 100 or 127"),
        ("t7 address 5 127 --port x", "1..=100"),
        ("t7 damping 5 5001 --port x", "2..=5000"),
        ("t7 offset 5 360000 --port x", "359999"),
        ("t7 scan some --port x", "all"),
        ("t7 angle 5 -a 3 --port x", "0, 1, 2"),
        ("t7 angle 5 --port x --echo maybe", "off, expected, detect"),
        ("t7 angle 5 --port tcp://host", "tcp://host:port"),
        ("t7 angle 5 --port x --rts-de --rs485", "cannot be used with"),
        ("isu angle 0 --port x", "--alone"),
        ("isu angle 15 --port x", "0..=14"),
        ("isu address 3 0 --yes --port x", "address 0"),
        ("isu null 3 65536 --port x", "65535"),
        ("isu auto-shutoff 3 on --port x", "--bit"),
        ("isu auto-shutoff 3 on --bit 2 --port x", "0, 1, 7"),
        ("watch t7 126 --port x", "1-100 or 127"),
        ("watch pwm 1 --port x", "t7|isu"),
        ("gateway restore --port x", "<FILE>"),
    ] {
        let said = misused(line);
        assert!(said.contains(part), "{line}: {said}");
    }
}
