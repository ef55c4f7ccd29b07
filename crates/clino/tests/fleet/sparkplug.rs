//! Sparkplug B, decoded by npm's `sparkplug-payload`.

use std::time::{Duration, Instant};

use clino_testkit::programs::{Node, skipped};
use serde_json::Value;

use crate::broker::{Broker, Listener, mosquitto};
use crate::gateway::Gateway;
use crate::program::Program;
use crate::{folder, until};

/// Reads base64 lines, writes JSON lines.
const DECODE: &str = "
const { get } = require('sparkplug-payload');
const decode = get('spBv1.0').decodePayload;
const text = require('fs').readFileSync(0, 'utf8').trim().split('\\n');
const plain = (key, value) => typeof value === 'bigint' || (value && value.constructor && value.constructor.name === 'Long') ? Number(value) : value;
for (const line of text) console.log(JSON.stringify(decode(Buffer.from(line, 'hex')), plain));
";

fn decoded(node: &Node, payloads: &[Vec<u8>]) -> Vec<Value> {
    use std::io::Write as _;
    let mut child = node
        .command()
        .args(["-e", DECODE])
        .stdin(std::process::Stdio::piped())
        .stdout(std::process::Stdio::piped())
        .spawn()
        .expect("node starts");
    let hex: Vec<String> =
        payloads.iter().map(|payload| payload.iter().map(|byte| format!("{byte:02x}")).collect()).collect();
    child.stdin.take().expect("it is piped").write_all(hex.join("\n").as_bytes()).expect("node reads");
    let output = child.wait_with_output().expect("node ends");
    let text = String::from_utf8(output.stdout).expect("text");
    text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect()
}

fn metric<'a>(payload: &'a Value, name: &str) -> Option<&'a Value> {
    payload["metrics"].as_array()?.iter().find(|metric| metric["name"] == name)
}

fn wait(heard: &Listener, topic: &str, count: usize) -> Vec<Vec<u8>> {
    until(topic, || {
        let of: Vec<_> = heard.of(topic).into_iter().map(|heard| heard.payload).collect();
        (of.len() >= count).then_some(of)
    })
}

#[test]
fn births_data_and_deaths_are_what_the_specification_says() {
    let Some(mosquitto) = mosquitto("fleet Sparkplug") else { return };
    let node = match Node::with(crate::programs(), &["sparkplug-payload@1.0.3"]) {
        Ok(node) => node,
        Err(why) => return skipped("fleet Sparkplug", &why),
    };
    let folder = folder("sparkplug");
    let broker = Broker::start(&mosquitto, &folder);
    let heard = broker.listen(&mosquitto);
    let gateway = Gateway::new();
    let configuration = format!(
        "[[gateway]]\nname = \"north\"\nconsole = \"{}\"\n[mqtt]\nhost = \"127.0.0.1\"\nport = {}\ndialect = \"sparkplug\"\ngroup = \"plant\"\n",
        gateway.endpoint(),
        broker.port()
    );
    let bridge = Program::bridge(&folder, &configuration);
    gateway.wait_for(1);
    wait(&heard, "spBv1.0/plant/NBIRTH/north", 1);
    gateway.end_line();
    // A gateway that speaks is asked who it is.
    gateway.say(r#"{"summary":[],"enabled":1,"online":1,"ok":1}"#);
    wait(&heard, "spBv1.0/plant/NBIRTH/north", 2);
    gateway.angle(0, "-12.345", 1_000, 1);
    wait(&heard, "spBv1.0/plant/DBIRTH/north/slot-0", 1);
    gateway.no_angle(0, "no_answer", 2);
    let births = decoded(&node, &wait(&heard, "spBv1.0/plant/NBIRTH/north", 2));
    for birth in &births {
        assert_eq!(birth["seq"], 0);
        assert_eq!(metric(birth, "bdSeq").expect("it is there")["value"], 0);
        assert_eq!(metric(birth, "Node Control/Rebirth").expect("it is there")["value"], false);
    }
    let device = decoded(&node, &wait(&heard, "spBv1.0/plant/DBIRTH/north/slot-0", 1));
    let angle = metric(&device[0], "Angle").expect("it is there");
    assert_eq!((&angle["value"], &angle["type"]), (&(-12.345).into(), &"Double".into()));
    assert_eq!(angle["properties"]["engUnit"]["value"], "deg");
    let measured = angle["timestamp"].as_i64().expect("a time");
    assert!((crate::now_ms() - 60_000..crate::now_ms() - 900).contains(&measured));
    let data = decoded(&node, &wait(&heard, "spBv1.0/plant/DDATA/north/slot-0", 1));
    let angle = metric(&data[0], "Angle").expect("it is there");
    assert!(angle["value"].is_null(), "{angle}");
    assert_eq!(metric(&data[0], "Status").expect("it is there")["value"], "no_answer");
    // A rebirth, asked for with a payload that npm's encoder makes.
    let encode = "const p = require('sparkplug-payload').get('spBv1.0').encodePayload({ timestamp: 1, seq: 0, metrics: [{ name: 'Node Control/Rebirth', type: 'Boolean', value: true }] });\
                  require('fs').writeFileSync(process.argv[1], p);";
    let command = folder.join("rebirth");
    assert!(node.command().args(["-e", encode]).arg(&command).status().expect("node starts").success());
    let before = heard.of("spBv1.0/plant/NBIRTH/north").len();
    let mut publisher = mosquitto.publisher();
    publisher
        .args(["-h", "127.0.0.1", "-p", &broker.port().to_string(), "-t", "spBv1.0/plant/NCMD/north", "-f"])
        .arg(&command);
    assert!(publisher.status().expect("it starts").success());
    wait(&heard, "spBv1.0/plant/NBIRTH/north", before + 1);
    // Its source goes: the device dies. The bridge is killed: the node dies, with the number of its birth.
    gateway.vanish();
    wait(&heard, "spBv1.0/plant/DDEATH/north/slot-0", 1);
    bridge.kill();
    let death = decoded(&node, &wait(&heard, "spBv1.0/plant/NDEATH/north", 1));
    assert_eq!(metric(&death[0], "bdSeq").expect("it is there")["value"], 0);
}

/// Messages of an edge node in the order in which they came, decoded.
fn of_node(node: &Node, heard: &Listener) -> Vec<(String, Value)> {
    let of: Vec<_> = heard.all().into_iter().filter(|heard| heard.topic.starts_with("spBv1.0/")).collect();
    let topics = of.iter().map(|heard| heard.topic.trim_start_matches("spBv1.0/clino/").to_owned());
    let payloads: Vec<_> = of.iter().map(|heard| heard.payload.clone()).collect();
    topics.zip(decoded(node, &payloads)).collect()
}

/// Angles of slot 0 in thousandths, in the order in which they came, with their time and whether they are history. Births tell
/// what is known already, and are left out.
fn angles(messages: &[(String, Value)]) -> Vec<(i64, i64, bool)> {
    let data = messages.iter().filter(|(topic, _)| topic == "DDATA/north/slot-0");
    let metrics = data.flat_map(|(_, payload)| payload["metrics"].as_array().expect("a list").clone());
    let angles = metrics.filter(|metric| metric["name"] == "Angle" && metric["value"].is_number());
    angles
        .map(|metric| {
            let thousandths = (metric["value"].as_f64().expect("a number") * 1_000.0).round() as i64;
            let at = metric["timestamp"].as_i64().expect("a time");
            (thousandths, at, metric["isHistorical"] == true)
        })
        .collect()
}

/// Between births of the node, `seq` counts all messages, from 0 to 255 and on from 0.
fn assert_sequence(messages: &[(String, Value)]) {
    let mut expected = 0;
    for (topic, payload) in messages.iter().filter(|(topic, _)| !topic.starts_with("NDEATH")) {
        if topic.starts_with("NBIRTH") {
            expected = 0;
        }
        assert_eq!(payload["seq"], expected, "{topic}");
        expected = (expected + 1) % 256;
    }
}

fn configuration(gateway: &Gateway, port: u16, folder: &std::path::Path) -> String {
    format!(
        "[[gateway]]\nname = \"north\"\nconsole = \"{}\"\n[mqtt]\nhost = \"127.0.0.1\"\nport = {port}\n\
         dialect = \"sparkplug\"\n[store]\nfolder = \"{}\"\n",
        gateway.endpoint(),
        folder.display()
    )
}

/// The broker is away for two runs of the bridge, the second of which is killed: what was told comes as history, in order, but
/// for the last second of the one that was killed.
#[test]
fn what_came_without_the_broker_is_history_when_it_is_back() {
    const TEST: &str = "fleet Sparkplug history";
    let Some(mosquitto) = mosquitto(TEST) else { return };
    let node = match Node::with(crate::programs(), &["sparkplug-payload@1.0.3"]) {
        Ok(node) => node,
        Err(why) => return skipped(TEST, &why),
    };
    let folder = folder("sparkplug-history");
    let broker = Broker::start(&mosquitto, &folder);
    let heard = broker.listen(&mosquitto);
    let gateway = Gateway::new();
    let mut told = Vec::new();
    let mut tell = |count: u32| {
        for _ in 0..count {
            let n = u32::try_from(told.len()).expect("few") + 1;
            gateway.angle(0, &format!("0.{n:03}"), 0, n);
            told.push(Instant::now());
            std::thread::sleep(Duration::from_millis(10));
        }
        told.clone()
    };
    let (nowhere, metrics) = (crate::free_port(), crate::free_port());
    let endpoint = format!("[prometheus]\nlisten = \"127.0.0.1:{metrics}\"\n");
    let first = Program::bridge(&folder, &(configuration(&gateway, nowhere, &folder) + &endpoint));
    gateway.wait_for(1);
    gateway.end_line();
    let in_first = tell(200).len() as i64;
    // It has read what it was told.
    until("the last value of the first run", || {
        crate::metrics::get(metrics, "/metrics").filter(|(_, text)| text.contains("} 0.2\n"))
    });
    assert!(first.end().success());
    let second = Program::bridge(&folder, &configuration(&gateway, nowhere, &folder));
    gateway.wait_for(2);
    gateway.end_line();
    let told = tell(250);
    let killed = Instant::now();
    second.kill();
    let third = Program::bridge(&folder, &configuration(&gateway, broker.port(), &folder));
    gateway.wait_for(3);
    wait(&heard, "spBv1.0/clino/NBIRTH/north", 1);
    gateway.end_line();
    gateway.angle(0, "0.999", 0, 999);
    wait(&heard, "spBv1.0/clino/DBIRTH/north/slot-0", 2);
    let messages = of_node(&node, &heard);
    let mut got = angles(&messages);
    assert!(got.iter().all(|(_, _, is_history)| *is_history), "{got:?}");
    // Told shortly before the gateway's start is known, this one comes before the births of it.
    got.retain(|(n, ..)| *n != 999);
    let numbers: Vec<_> = got.iter().map(|(n, ..)| *n).collect();
    assert!(numbers.windows(2).all(|pair| pair[1] == pair[0] + 1), "{numbers:?}");
    assert!(got.windows(2).all(|pair| pair[0].1 <= pair[1].1), "{got:?}");
    // Of the first run, everything; of the second, all but the last second. A busy computer is given half of one more.
    assert!(numbers.first() == Some(&1) && numbers.last() > Some(&in_first), "{numbers:?}");
    let missing = usize::try_from(*numbers.last().expect("some")).expect("few");
    let oldest = told.get(missing).map_or(Duration::ZERO, |at| killed - *at);
    assert!(oldest <= Duration::from_millis(1_500), "lost from {missing} on, the oldest {oldest:?} old");
    // The device was lent a life for its history; then it has a source.
    let kinds: Vec<_> =
        messages.iter().map(|(topic, _)| topic.split('/').next().unwrap_or_default()).collect();
    assert_eq!(kinds[..3], ["NBIRTH", "DBIRTH", "DDATA"], "{kinds:?}");
    let births: Vec<_> = messages.iter().filter(|(topic, _)| topic.starts_with("DBIRTH")).collect();
    assert!(metric(&births[0].1, "Angle").expect("it is there")["value"].is_null(), "{:?}", births[0]);
    assert_eq!(metric(&births[0].1, "Status").expect("it is there")["value"], "source_gone");
    let last = births.last().expect("some");
    assert_eq!(metric(&last.1, "Angle").expect("it is there")["value"], 0.999, "{births:?}");
    assert_sequence(&messages);
    assert!(third.end().success());
}

/// A wire that is cut in the middle: data of QoS 0 that was on its way comes again as history, and nothing is missing.
#[test]
fn what_was_on_a_wire_that_was_cut_comes_again() {
    const TEST: &str = "fleet Sparkplug wire";
    let Some(mosquitto) = mosquitto(TEST) else { return };
    let node = match Node::with(crate::programs(), &["sparkplug-payload@1.0.3"]) {
        Ok(node) => node,
        Err(why) => return skipped(TEST, &why),
    };
    let folder = folder("sparkplug-wire");
    let broker = Broker::start(&mosquitto, &folder);
    let heard = broker.listen(&mosquitto);
    let gateway = Gateway::new();
    let wire = crate::wire::Wire::to(broker.port());
    let bridge = Program::bridge(&folder, &configuration(&gateway, wire.port(), &folder));
    gateway.wait_for(1);
    gateway.end_line();
    let mut told = 0;
    let mut tell = |count: u32| {
        gateway.angles(count, &mut told, 0, Duration::from_millis(2));
        told
    };
    tell(10);
    wait(&heard, "spBv1.0/clino/DBIRTH/north/slot-0", 1);
    for _ in 0..3 {
        tell(300);
        wire.cut();
        tell(300);
        wire.mend();
        let births = heard.of("spBv1.0/clino/NBIRTH/north").len();
        wait(&heard, "spBv1.0/clino/NBIRTH/north", births + 1);
    }
    let last = i64::from(tell(10));
    let messages = until("the last value", || {
        let messages = of_node(&node, &heard);
        (angles(&messages).last()?.0 == last).then_some(messages)
    });
    let got = angles(&messages);
    let mut known = std::collections::BTreeSet::new();
    let firsts: Vec<_> = got.iter().map(|(n, ..)| *n).filter(|n| known.insert(*n)).collect();
    assert!(firsts.is_sorted(), "{firsts:?}");
    // The births of a connection tell the value of their time; it need not come again.
    let missing: Vec<_> = (1..=last).filter(|n| !known.contains(n)).collect();
    let born: Vec<_> = messages
        .iter()
        .filter(|(topic, _)| topic.starts_with("DBIRTH"))
        .filter_map(|(_, birth)| metric(birth, "Angle")?["value"].as_f64())
        .map(|degrees| (degrees * 1_000.0).round() as i64)
        .collect();
    assert!(missing.iter().all(|n| born.contains(n)), "{missing:?} of {born:?}");
    assert!(
        got.iter().any(|(_, _, is_history)| *is_history) && got.iter().any(|(_, _, is_history)| !is_history)
    );
    assert_sequence(&messages);
    assert!(bridge.end().success());
}
