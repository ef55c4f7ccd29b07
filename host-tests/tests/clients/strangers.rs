//! Modbus masters that were written by others for others: libmodbus in C, minimalmodbus, npm's modbus-serial and jsmodbus,
//! tokio-modbus. Each reads the same things in its own way, and sets up a slot.
//!
//! The programs in `strangers/` take where things are, so that they know nothing of us:
//! `PORT ANGLES AGES FLOATS CDAB COUNTER SLOT SPARE`, register addresses of the first slot's angle, age and floats in both
//! orders, of a counter, of the settings of an unused slot, and the address of a T7 that no slot reads. They print:
//!
//! ```text
//! angles MDEG…       ages MS…       floats DEG…       cdab DEG…      counter N
//! object NUMBER TEXT                                  each, by function 43, if the client has it
//! messages N                                          by function 08, if the client has it
//! set_up MDEG                                         what the unused slot reads then
//! ```
//!
//! A computer may be much slower than real time: they read until all angles are there, and wait for an answer for a
//! minute. Where a client cannot be had, its test says SKIPPED on standard error.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use clino_board::BoardModel;
use clino_testkit::programs::{Libmodbus, Node, Python, said, skipped};

use super::bench::{SPARE_ADDRESS, angle, spare_angle};
use super::board::Board;

const SLOTS: usize = 6;
/// From docs/modbus.md: angles, ages, floats, floats with their registers swapped, good answers on the T7 bus, settings of
/// slot 6.
const REGISTERS: [u16; 6] = [0x0020, 0x0060, 0x0700, 0x0860, 0x0906, 0x10C0];
const NODE: [&str; 3] = ["modbus-serial@8.0.25", "jsmodbus@5.0.0", "serialport@13.0.0"];

/// What a client may not have: functions 43 and 08.
#[derive(Clone, Copy)]
struct Knows {
    identification: bool,
    diagnostics: bool,
}

const ALL: Knows = Knows { identification: true, diagnostics: true };

fn source(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/clients/strangers").join(name)
}

fn place() -> &'static Path {
    Path::new(env!("CARGO_TARGET_TMPDIR"))
}

/// Runs a client against a board of its own, and holds what it prints against the truth.
fn check(name: &str, client: Result<Command, String>, knows: Knows) {
    let mut client = match client {
        Ok(client) => client,
        Err(why) => return skipped(name, &format!("it could not be had\n{why}")),
    };
    let board = Board::start(name);
    client
        .arg(&board.modbus)
        .args(REGISTERS.map(|register| register.to_string()))
        .arg(SPARE_ADDRESS.to_string());
    let output = client.output().expect("the client runs");
    assert!(output.status.success(), "{name}: {}", said(&output));
    println!("{name}: {}", said(&output));
    let text = String::from_utf8_lossy(&output.stdout);
    let mut lines: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for line in text.lines() {
        let (key, value) = line.split_once(' ').unwrap_or_else(|| panic!("{name}: {line}"));
        lines.entry(key).or_default().push(value);
    }
    let numbers = |key: &str| -> Vec<f64> {
        let [line] = lines.get(key).unwrap_or_else(|| panic!("{name}: no {key}"))[..] else {
            panic!("{name}: {key} more than once")
        };
        line.split(' ').map(|number| number.parse().expect(key)).collect()
    };
    for (key, unit) in [("angles", 1e-3), ("floats", 1.0), ("cdab", 1.0)] {
        let found = numbers(key);
        assert_eq!(found.len(), SLOTS, "{name}: {key}");
        for (slot, number) in found.iter().enumerate() {
            let (degrees, tolerance) = angle(slot).expect("a sensor");
            let away = (number * unit - degrees).abs();
            assert!(away <= tolerance + 0.000_6, "{name}: {key} of slot {slot}: {number}, {degrees}");
        }
    }
    assert!(numbers("ages").iter().all(|age| (0.0..2_000.0).contains(age)), "{name}");
    assert!(numbers("counter")[0] > 10.0, "{name}");
    let (degrees, tolerance) = spare_angle();
    let set_up = numbers("set_up")[0];
    assert!((set_up / 1e3 - degrees).abs() <= tolerance, "{name}: {set_up}, {degrees}");
    assert_eq!(lines.contains_key("object"), knows.identification, "{name}");
    if knows.identification {
        let objects: BTreeMap<u8, &str> = lines["object"]
            .iter()
            .map(|object| object.split_once(' ').expect("an object with a text"))
            .map(|(number, text)| (number.parse().expect("a number"), text))
            .collect();
        assert_eq!((objects[&0], objects[&1]), ("clino", product()), "{name}");
        assert_eq!(objects[&2], env!("CARGO_PKG_VERSION"), "{name}");
        assert!(objects.keys().copied().all(|number| number < 6), "{name}: {objects:?}");
        assert!(objects.values().all(|text| !text.is_empty()), "{name}: {objects:?}");
    }
    assert_eq!(lines.contains_key("messages"), knows.diagnostics, "{name}");
    assert!(!knows.diagnostics || numbers("messages")[0] >= 6.0, "{name}");
    board.stop();
}

#[test]
fn libmodbus() {
    let client = Libmodbus::compile(place(), &source("libmodbus.c")).map(|program| program.command());
    check("libmodbus", client, ALL);
}

#[test]
fn minimalmodbus() {
    let python = Python::with(place(), &["minimalmodbus==2.1.1", "pyserial==3.5"]).map(|python| {
        let mut command = python.command();
        command.arg("-B").arg(source("minimal.py"));
        command
    });
    check("minimalmodbus", python, ALL);
}

/// Both of them, one after the other: they are installed together.
#[test]
fn node() {
    let node = Node::with(place(), &NODE);
    for (name, script, identification) in
        [("modbus-serial", "modbus_serial.js", true), ("jsmodbus", "jsmodbus.js", false)]
    {
        let client = node.as_ref().map_err(Clone::clone).map(|node| {
            let mut command = node.command();
            command.arg(source(script));
            command
        });
        check(name, client, Knows { identification, diagnostics: false });
    }
}

/// Its answers to functions it does not know are as long as what has come so far (`get_response_pdu_len` in its RTU codec), so
/// that on a line, where characters come one by one, function 08 is never answered for it.
#[test]
fn tokio_modbus() {
    let target = place().join("tokio-modbus");
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["build", "--locked", "--manifest-path"]).arg(source("tokio/Cargo.toml"));
    cargo.arg("--target-dir").arg(&target);
    let built = cargo.output().map_err(|why| format!("{why}\n"));
    let client = built.and_then(|output| match output.status.success() {
        true => Ok(Command::new(target.join("debug/clino-stranger-tokio"))),
        false => Err(said(&output)),
    });
    check("tokio-modbus", client, Knows { identification: true, diagnostics: false });
}

/// Product code of the image.
fn product() -> &'static str {
    match clino_host_tests::model() {
        BoardModel::F407Disc1 | BoardModel::F407Ve => "clino-f407",
        BoardModel::NucleoF446re => "clino-f446",
    }
}
