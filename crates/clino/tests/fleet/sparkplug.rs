//! Sparkplug B, decoded by npm's `sparkplug-payload`.

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
