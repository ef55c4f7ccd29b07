//! What the documents tell people to type, as it stands there; only ports and paths are replaced by those of this test. The
//! shipped image on the virtual board is the gateway.

use std::fmt::Write as _;
use std::process::Command;

use serde_json::Value;

use crate::board::Board;
use crate::broker::{Broker, Listener, mosquitto};
use crate::metrics::get;
use crate::program::{CLINO, Program};
use crate::server::Server;
use crate::{folder, free_port, until};

/// A file of the repository.
pub fn document(name: &str) -> String {
    let path = crate::repository(name);
    std::fs::read_to_string(&path).unwrap_or_else(|why| panic!("{}: {why}", path.display()))
}

/// Replaces what is there exactly once.
fn replaced(text: &str, old: &str, new: &str) -> String {
    assert_eq!(text.matches(old).count(), 1, "{old} in\n{text}");
    text.replace(old, new)
}

/// What comes behind `clino` in the line of a document that begins so.
fn typed(document: &str, beginning: &str) -> Vec<String> {
    let at = document.find(beginning).unwrap_or_else(|| panic!("no {beginning}"));
    let line = document[at..].split(['`', '\n', '#']).next().unwrap_or_default();
    let rest = line.strip_prefix("cargo run -p clino -- ").expect("a line for cargo");
    rest.split_whitespace().map(str::to_owned).collect()
}

fn has_value(batch: &Value, slot: u64) -> bool {
    let values = batch["values"].as_array();
    values.is_some_and(|all| all.iter().any(|value| value["slot"] == slot && value["status"] == "ok"))
}

/// The gateways of `docs/bridge.example.toml`: the board by both its doors, and T7s on a bus.
struct Sources {
    /// The example, with their ports.
    configuration: String,
    _board: Board,
    _sensors: Server,
}

impl Sources {
    /// Or a loud skip.
    fn start(test: &str) -> Option<Sources> {
        let (board, [console, modbus]) = Board::both(test)?;
        let sensors = Server::start("--pty --t7 1,angle=sine:0:10:8s --t7 2,angle=5");
        let mut text = document("docs/bridge.example.toml");
        for (old, new) in [
            ("console = \"/dev/ttyUSB0\"", format!("console = \"{console}\"")),
            ("modbus = \"tcp://192.168.1.20:502\"", format!("modbus = \"{modbus}\"")),
            ("port = \"/dev/ttyUSB1\"", format!("port = \"{}\"", sensors.path())),
        ] {
            text = replaced(&text, old, &new);
        }
        Some(Sources { configuration: text, _board: board, _sensors: sensors })
    }
}

/// The example of a configuration, running.
struct Example {
    heard: Listener,
    prometheus: u16,
    bridge: Program,
    _broker: Broker,
    _sources: Sources,
}

impl Example {
    /// `clino bridge` with `docs/bridge.example.toml`; or a loud skip.
    fn start(test: &str) -> Option<Example> {
        let mosquitto = mosquitto(test)?;
        let sources = Sources::start(test)?;
        let folder = folder(&test.replace(' ', "-"));
        let broker = Broker::start(&mosquitto, &folder);
        let heard = broker.listen(&mosquitto);
        let prometheus = free_port();
        let host = format!("host = \"localhost\"\nport = {}", broker.port());
        let text = replaced(&sources.configuration, "host = \"localhost\"", &host);
        let text = replaced(&text, "127.0.0.1:9184", &format!("127.0.0.1:{prometheus}"));
        let file = folder.join("bridge.toml");
        std::fs::write(&file, text).expect("a folder of this test");
        let mut arguments = typed(&document("docs/fleet.md"), "cargo run -p clino -- bridge");
        let last = arguments.last_mut().expect("arguments");
        assert_eq!(last, "docs/bridge.example.toml");
        *last = file.display().to_string();
        let mut command = Command::new(CLINO);
        // Where systemd's StateDirectory= would be.
        command.args(arguments).env("STATE_DIRECTORY", folder.join("state"));
        let bridge = Program::run(&folder, command);
        Some(Example { heard, prometheus, bridge, _broker: broker, _sources: sources })
    }

    /// Waits until each of its gateways has a value at the broker.
    fn wait(&self) {
        for gateway in ["north-pier", "south-pier", "bench"] {
            self.heard.wait(&format!("clino/{gateway}/state"), |batch| has_value(batch, 0));
        }
    }
}

#[test]
fn the_example_feeds_a_broker() {
    let Some(mut example) = Example::start("fleet example") else { return };
    example.wait();
    let heard = &example.heard;
    // Names of sensors are those of the file, angles those of the scenario: three T7s, an ISU, two PWM inputs.
    let of_north = |slot: u64| heard.wait("clino/north-pier/state", |batch| has_value(batch, slot));
    let value = |batch: &Value, slot: u64| {
        batch["values"].as_array().and_then(|all| all.iter().find(|value| value["slot"] == slot)).cloned()
    };
    let named = value(&of_north(0), 0).expect("it is there");
    assert_eq!((&named["name"], &named["kind"]), (&"Tower, east".into(), &"t7".into()));
    let still = value(&of_north(2), 2).expect("it is there");
    assert_eq!(still["angle_deg"].to_string(), "12.345");
    // The same angle of the same board through its other door.
    let batch = heard.wait("clino/south-pier/state", |batch| has_value(batch, 2));
    assert_eq!(value(&batch, 2).expect("it is there")["angle_deg"].to_string(), "12.345");
    heard.wait("clino/south-pier/status", |status| status["state"] == "online" && status["boot"].is_string());
    for gateway in ["north-pier", "south-pier", "bench"] {
        heard.wait(&format!("homeassistant/device/clino_{gateway}/config"), |device| {
            device["components"].as_object().is_some_and(|all| !all.is_empty())
        });
    }
    until("the endpoint", || {
        let (_, text) = get(example.prometheus, "/metrics")?;
        ["north-pier", "south-pier", "bench"]
            .iter()
            .all(|gateway| text.contains(&format!("clino_angle_degrees{{gateway=\"{gateway}\"")))
            .then_some(())
    });
    // Lines for InfluxDB are on standard output.
    assert!(example.bridge.first_line().starts_with("clino_"));
    assert!(example.bridge.end().success(), "it ends when it is asked to");
}

/// "The same file serves `clino serve --config`". With `UPDATE=1` the document gets a picture of it.
#[test]
fn the_example_shows_its_gateways_on_one_page() {
    const TEST: &str = "fleet example page";
    let Some(sources) = Sources::start(TEST) else { return };
    let folder = folder("example-page");
    let port = free_port();
    let text = replaced(&sources.configuration, "127.0.0.1:8080", &format!("127.0.0.1:{port}"));
    let file = folder.join("bridge.toml");
    std::fs::write(&file, text).expect("a folder of this test");
    let mut serve = Program::start(&folder, &["serve", "--config", &file.display().to_string()]);
    let address = serve.first_line();
    until("all values", || {
        let state: Value = serde_json::from_str(&get(port, "/api/state")?.1).ok()?;
        let right = |gateway: &Value| {
            let sensors = gateway["sensors"].as_array().map_or(&[][..], Vec::as_slice);
            sensors.iter().filter(|sensor| sensor["status"] == "ok").count()
        };
        let counts: Vec<_> = state["gateways"].as_array()?.iter().map(right).collect();
        // Three T7s, an ISU and two PWM inputs, twice; two T7s.
        (counts == [6, 6, 2]).then_some(())
    });
    if !crate::updates() {
        return;
    }
    let Some((chromium, node)) = crate::browser::browser(TEST) else { return };
    let output = node
        .command()
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fleet/picture.js"))
        .arg(&chromium.program)
        .arg(address.replace("127.0.0.1", "localhost"))
        .arg(crate::repository("docs/fleet-example.png"))
        .output()
        .expect("node starts");
    assert!(output.status.success(), "{}", clino_testkit::programs::said(&output));
}

#[test]
fn the_lines_that_show_the_page_show_it() {
    const TEST: &str = "fleet serve";
    let folder = folder("serve-line");
    for (name, port) in [("README.md", "/dev/ttyACM0"), ("docs/fleet.md", "/dev/ttyUSB0")] {
        let Some((_board, console)) = Board::console(TEST) else { return };
        let mut arguments = typed(&document(name), "cargo run -p clino -- serve");
        let place = arguments.iter_mut().find(|argument| *argument == port).expect("a port");
        *place = console;
        // Another program of this computer may be at the usual port.
        arguments.extend(["--listen".to_owned(), format!("127.0.0.1:{}", free_port())]);
        let arguments: Vec<_> = arguments.iter().map(String::as_str).collect();
        let mut serve = Program::start(&folder, &arguments);
        let line = serve.first_line();
        let port = line.trim_end_matches('/').rsplit(':').next().and_then(|port| port.parse().ok());
        let port = port.unwrap_or_else(|| panic!("{line}"));
        let (head, page) = until("the page", || get(port, "/"));
        assert!(head.starts_with("HTTP/1.1 200") && page.contains("<html"), "{head}");
        let angle = until("an angle", || {
            let state: Value = serde_json::from_str(&get(port, "/api/state")?.1).ok()?;
            let sensors = state["gateways"][0]["sensors"].as_array()?.clone();
            sensors.iter().find(|sensor| sensor["slot"] == 2 && sensor["status"] == "ok").cloned()
        });
        assert_eq!(angle["angle_mdeg"], 12_345, "{name}");
        assert!(serve.end().success(), "{name}");
    }
}

/// Numbers that differ from run to run.
fn without_numbers(text: &str) -> String {
    let mut plain = String::new();
    for letter in text.chars() {
        match letter {
            '0'..='9' if plain.ends_with('#') => {}
            '0'..='9' => plain.push('#'),
            '.' | '-' if plain.ends_with('#') => {}
            '-' => {}
            _ => plain.push(letter),
        }
    }
    plain
}

/// The beginning of the block of this name.
fn mark(name: &str) -> String {
    format!("<!-- bridge: {name} -->\n```text\n")
}

/// What stands in it.
fn block(document: &str, name: &str) -> String {
    let rest = document.split(&mark(name)).nth(1).unwrap_or_else(|| panic!("no {}", mark(name)));
    rest.split("```").next().unwrap_or_default().to_owned()
}

/// Whether a message is one that the document shows.
type IsWanted<'a> = &'a dyn Fn(&str) -> bool;

/// What `mosquitto_sub -v` prints of the example, and what Prometheus scrapes: as in `docs/fleet.md`, but for its numbers.
/// `UPDATE=1` writes it there.
#[test]
fn the_document_shows_what_the_broker_carries_and_what_prometheus_scrapes() {
    let Some(example) = Example::start("fleet document") else { return };
    example.wait();
    let heard = &example.heard;
    let mut carried = String::new();
    // A message of each kind that does not depend on what came first.
    let is_online =
        |text: &str| text.contains("\"online\"") && text.contains("cause") && text.contains("signals\":[]");
    let is_whole = |text: &str| text.matches("\"slot\"").count() == 2 && text.matches("\"ok\"").count() == 2;
    let wanted: [(&str, IsWanted<'_>); 6] = [
        ("clino/bridge/site/status", &|text| text == "online"),
        ("clino/north-pier/status", &is_online),
        ("clino/bench/state", &is_whole),
        ("clino/north-pier/event", &|text| text.contains("\"start\"")),
        ("clino/south-pier/status", &is_online),
        ("clino/bench/0/value", &|text| text.contains("\"ok\"")),
    ];
    for (topic, is_wanted) in wanted {
        let message = until(topic, || {
            let all = heard.of(topic).into_iter();
            all.rev().find(|heard| is_wanted(&String::from_utf8_lossy(&heard.payload)))
        });
        let _ = writeln!(carried, "{topic} {}", String::from_utf8_lossy(&message.payload));
    }
    let wanted = [
        "clino_angle_degrees{gateway=\"bench\"",
        "clino_sensor_ok{gateway=\"bench\"",
        "clino_gateway_up",
        "clino_broker_connected",
        "clino_store_trouble",
    ];
    let scraped = until("all samples", || {
        let (_, text) = get(example.prometheus, "/metrics")?;
        let lines = text.lines().filter(|line| wanted.iter().any(|beginning| line.starts_with(beginning)));
        let text: String = lines.map(|line| format!("{line}\n")).collect();
        // Two T7s are right, three gateways are there.
        (text.contains("clino_broker_connected 1") && text.matches("} 1.0\n").count() == 5).then_some(text)
    });
    let mut page = document("docs/fleet.md");
    for (name, now) in [("mosquitto_sub -v", &carried), ("curl /metrics", &scraped)] {
        let before = block(&page, name);
        if without_numbers(&before) == without_numbers(now) {
            continue;
        }
        assert!(crate::updates(), "{name}: UPDATE=1 writes it anew\n{before}\nis now\n{now}");
        page = page.replace(&(mark(name) + &before), &(mark(name) + now));
        std::fs::write(crate::repository("docs/fleet.md"), &page).expect("the repository can be written");
    }
}
