//! Where values come from: a bus without a gateway, a gateway's Modbus port over every wire, many at once; what a source does
//! that goes and comes back, and one that speaks something else.

use std::fmt::Write as _;

use serde_json::Value;

use crate::broker::{Broker, Heard, Listener, mosquitto};
use crate::gateway::Gateway;
use crate::program::Program;
use crate::registers::{Framing, Registers};
use crate::server::{Server, Signal};
use crate::{folder, until};

/// A configuration with these gateways, each with its lines, and this broker.
fn configuration(gateways: &[(&str, String)], broker: &Broker, folder: &std::path::Path) -> String {
    let mut text = String::new();
    for (name, lines) in gateways {
        let _ = writeln!(text, "[[gateway]]\nname = \"{name}\"\n{lines}");
    }
    let _ = write!(
        text,
        "[mqtt]\nhost = \"127.0.0.1\"\nport = {}\n[store]\nfolder = \"{}\"\n",
        broker.port(),
        folder.display()
    );
    text
}

/// Waits for a value of a gateway's slot that is as wanted.
fn wait(heard: &Listener, gateway: &str, slot: u64, is_wanted: impl Fn(&Value) -> bool) -> Value {
    let is_it = |value: &&Value| value["slot"] == slot && is_wanted(value);
    let of = |batch: &Value| batch["values"].as_array().and_then(|all| all.iter().find(is_it)).cloned();
    let batch = heard.wait(&format!("clino/{gateway}/state"), |batch| of(batch).is_some());
    of(&batch).expect("it was found")
}

fn has_status(word: &str) -> impl Fn(&Value) -> bool {
    move |value| value["status"] == word
}

/// The last status of a gateway.
fn state(heard: &Listener, gateway: &str) -> Option<Value> {
    heard.of(&format!("clino/{gateway}/status")).last().map(Heard::json)
}

/// Of an old value there is none: every batch from this one on has no angle of this gateway.
fn has_no_angle(batches: &[Heard]) -> bool {
    batches.iter().all(|batch| {
        let batch = batch.json();
        batch["values"].as_array().is_some_and(|all| all.iter().all(|value| value["angle_deg"].is_null()))
    })
}

/// T7s at 5° and -12.345°, an ISU at 90°, as `clino sim` has them; one address without a sensor. Then the adapter is pulled and
/// plugged in again.
#[test]
fn a_bus_is_read_directly_and_comes_back_with_its_port() {
    let Some(mosquitto) = mosquitto("fleet bus") else { return };
    let folder = folder("bus");
    let broker = Broker::start(&mosquitto, &folder);
    let heard = broker.listen(&mosquitto);
    let isus = Server::start("--pty --isu 1,angle=90");
    // Its name stays when the adapter gets another: as udev makes one.
    let adapter = folder.join("adapter");
    let plug_in = || {
        let sensors = Server::start("--pty --t7 1,angle=5 --t7 2,angle=-12.345");
        let _ = std::fs::remove_file(&adapter);
        std::os::unix::fs::symlink(sensors.path(), &adapter).expect("a folder of this test");
        sensors
    };
    let sensors = plug_in();
    let bench = format!("bus = \"t7\"\nport = \"{}\"\naddresses = [1, 2, 3]", adapter.display());
    let other = format!("bus = \"isu\"\nport = \"{}\"\naddresses = [1]", isus.path());
    let text = configuration(&[("bench", bench), ("other", other)], &broker, &folder);
    let bridge = Program::bridge(&folder, &text);
    for (gateway, slot, degrees) in [("bench", 0, 5.0), ("bench", 1, -12.345), ("other", 0, 90.0)] {
        let value = wait(&heard, gateway, slot, has_status("ok"));
        let angle = value["angle_deg"].as_f64().expect("a number");
        // A T7 tells thousandths, an ISU hundredths.
        assert!((angle - degrees).abs() < 0.011, "{gateway} {slot}: {angle}");
    }
    assert_eq!(wait(&heard, "bench", 2, has_status("no_answer"))["angle_deg"], Value::Null);
    sensors.stop(Signal::TERM);
    wait(&heard, "bench", 0, has_status("source_gone"));
    let gone = until("the going", || state(&heard, "bench").filter(|state| state["state"] == "offline"));
    assert!(gone["why"].as_str().is_some_and(|why| why.contains("adapter")), "{gone}");
    let before = heard.of("clino/bench/state").len();
    // The other bus goes on.
    let outcome = wait(&heard, "other", 0, has_status("ok"))["outcome"].as_u64().expect("a number");
    wait(&heard, "other", 0, |value| value["outcome"].as_u64().is_some_and(|now| now > outcome + 3));
    assert!(has_no_angle(&heard.of("clino/bench/state")[before..]));
    let _sensors = plug_in();
    until("the return", || {
        let batches = heard.of("clino/bench/state");
        batches[before..].iter().any(|batch| batch.json()["values"][0]["status"] == "ok").then_some(())
    });
    until("the return's status", || state(&heard, "bench").filter(|state| state["state"] == "online"));
    assert!(bridge.end().success());
}

/// The same gateway over each wire: one read of angles and ages, statuses, its start, its alarms; its going and its return.
#[test]
fn a_modbus_port_is_read_over_tcp_over_rtu_in_tcp_and_over_a_serial_port() {
    let Some(mosquitto) = mosquitto("fleet Modbus") else { return };
    let folder = folder("modbus");
    let broker = Broker::start(&mosquitto, &folder);
    let heard = broker.listen(&mosquitto);
    let tcp = Registers::in_network(Framing::Tcp);
    let rtu = Registers::in_network(Framing::Rtu);
    let serial = Registers::on_terminal();
    let all = [("tcp", &tcp, Framing::Tcp), ("rtu", &rtu, Framing::Rtu), ("serial", &serial, Framing::Rtu)];
    let lines = |(name, registers, framing): &(&'static str, &Registers, Framing)| {
        (*name, format!("modbus = \"{}\"\nevery_ms = 100", registers.endpoint(*framing)))
    };
    for (_, registers, _) in &all {
        registers.set(0, Some((-12_345, 60_000)));
        registers.set(31, Some((1, 5)));
        registers.set(32, None);
        registers.set(47, Some((359_999, 7)));
    }
    let gateways: Vec<_> = all.iter().map(lines).collect();
    let bridge = Program::bridge(&folder, &configuration(&gateways, &broker, &folder));
    for (gateway, registers, _) in &all {
        let value = wait(&heard, gateway, 0, has_status("ok"));
        assert_eq!(value["angle_deg"].to_string(), "-12.345", "{gateway}");
        assert_eq!((&value["kind"], &value["address"]), (&"t7".into(), &1.into()), "{gateway}");
        let age = crate::now_ms() - value["ts"].as_i64().expect("a number");
        assert!((60_000..120_000).contains(&age), "{gateway}: {age} ms");
        assert_eq!(
            wait(&heard, gateway, 31, has_status("ok"))["angle_deg"].to_string(),
            "0.001",
            "{gateway}"
        );
        assert_eq!(
            wait(&heard, gateway, 47, has_status("ok"))["angle_deg"].to_string(),
            "359.999",
            "{gateway}"
        );
        assert_eq!(wait(&heard, gateway, 32, has_status("no_answer"))["angle_deg"], Value::Null, "{gateway}");
        let status = until("the start", || state(&heard, gateway).filter(|state| state["boot"] == "3.2"));
        assert_eq!(status["version"], "0.1.0", "{gateway}");
        registers.alarms(1);
        let event = heard.wait(&format!("clino/{gateway}/event"), |event| event["event"] == "alarm");
        assert_eq!((&event["slot"], &event["state"]), (&0.into(), &"active".into()), "{gateway}");
    }
    let port = tcp.port();
    tcp.vanish();
    wait(&heard, "tcp", 0, has_status("source_gone"));
    let before = heard.of("clino/tcp/state").len();
    let again = Registers::at(Framing::Tcp, port);
    again.set(0, Some((7_000, 1)));
    until("the return", || {
        let batches = heard.of("clino/tcp/state");
        batches[before..].iter().any(|batch| batch.json()["values"][0]["angle_deg"] == 7.0).then_some(())
    });
    assert!(bridge.end().success());
}

/// Each door with what another one speaks: the gateway is gone, the reason says what is wrong, and nothing looks like a value.
#[test]
fn a_source_that_speaks_something_else_is_gone_with_a_reason() {
    let Some(mosquitto) = mosquitto("fleet foreign") else { return };
    let folder = folder("foreign");
    let broker = Broker::start(&mosquitto, &folder);
    let heard = broker.listen(&mosquitto);
    let console = Gateway::new();
    let registers = Registers::in_network(Framing::Rtu);
    let foreign = Registers::in_network(Framing::Tcp);
    foreign.forget_magic();
    let sensors = Server::start("--pty --isu 1,angle=90");
    let closed = crate::free_port();
    let at = |port: u16| format!("tcp://127.0.0.1:{port}");
    let gateways = [
        // A console that is asked for Modbus; both ways of it.
        ("tcp-at-console", format!("modbus = \"{}\"\nevery_ms = 50", console.endpoint())),
        ("rtu-at-console", format!("modbus = \"rtu+{}\"\nevery_ms = 50", console.endpoint())),
        // A Modbus port that is read as a console, and one of a device that is no gateway.
        ("console-at-modbus", format!("console = \"{}\"", at(registers.port()))),
        ("another-device", format!("modbus = \"{}\"\nevery_ms = 50", foreign.endpoint(Framing::Tcp))),
        // A broker, which closes what it does not understand.
        ("console-at-broker", format!("console = \"{}\"", at(broker.port()))),
        // T7s are asked for on a bus with an ISU.
        ("t7-at-isu", format!("bus = \"t7\"\nport = \"{}\"\naddresses = [1]", sensors.path())),
        ("nothing-there", format!("console = \"{}\"", at(closed))),
        ("no-such-port", "console = \"/dev/clino-no-such-port\"".to_owned()),
    ];
    let bridge = Program::bridge(&folder, &configuration(&gateways, &broker, &folder));
    for (gateway, part) in [
        ("tcp-at-console", "127.0.0.1"),
        ("rtu-at-console", "127.0.0.1"),
        ("console-at-modbus", "nothing received"),
        ("another-device", "no clino gateway"),
        ("console-at-broker", "127.0.0.1"),
        ("nothing-there", "refused"),
        ("no-such-port", "/dev/clino-no-such-port"),
    ] {
        let state = until(gateway, || {
            let state = state(&heard, gateway).filter(|state| state["state"] == "offline")?;
            state["why"].as_str().is_some_and(|why| why.contains(part)).then_some(state)
        });
        assert!(state["why"].as_str().is_some_and(|why| !why.contains("not heard")), "{state}");
    }
    // Its port is there, its sensor is not.
    let status = wait(&heard, "t7-at-isu", 0, |_| true)["status"].clone();
    assert!(["no_answer", "bad_answer"].contains(&status.as_str().expect("text")), "{status}");
    let states: Vec<_> = heard.all().into_iter().filter(|heard| heard.topic.ends_with("/state")).collect();
    assert!(has_no_angle(&states));
    assert!(bridge.end().success());
}
