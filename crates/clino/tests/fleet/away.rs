//! The broker is away, and the bridge is killed: what was told arrives, in order, once it is back.

use std::collections::BTreeSet;
use std::thread;
use std::time::{Duration, Instant};

use crate::broker::{Broker, Heard, Listener, mosquitto};
use crate::gateway::Gateway;
use crate::metrics::get;
use crate::program::Program;
use crate::wire::Wire;
use crate::{folder, free_port, until};

fn configuration(gateway: &Gateway, port: u16, folder: &std::path::Path, most_mb: u32) -> String {
    format!(
        "[[gateway]]\nname = \"north\"\nconsole = \"{}\"\n[mqtt]\nhost = \"127.0.0.1\"\nport = {port}\n\
         [store]\nfolder = \"{}\"\nmost_mb = {most_mb}\n",
        gateway.endpoint(),
        folder.display()
    )
}

/// `outcome` of every value of slot 0 in the order in which the messages came, repetitions left out by their `seq`.
pub fn outcomes(heard: &[Heard]) -> Vec<u64> {
    let mut seen = BTreeSet::new();
    let batches = heard.iter().filter(|heard| heard.topic == "clino/north/state").map(Heard::json);
    let fresh = batches.filter(|batch| seen.insert(batch["seq"].as_u64().expect("a number")));
    fresh
        .flat_map(|batch| batch["values"].as_array().expect("a list").clone())
        .filter(|value| value["status"] == "ok")
        .map(|value| value["outcome"].as_u64().expect("a number"))
        .collect()
}

/// A broker behind a wire that is cut, and its client, which hears everything once the wire is mended.
fn behind_a_cut_wire(test: &str, folder: &std::path::Path) -> Option<(Broker, Listener, Wire)> {
    let mosquitto = mosquitto(test)?;
    let broker = Broker::start(&mosquitto, folder);
    let heard = broker.listen(&mosquitto);
    let wire = Wire::to(broker.port());
    wire.cut();
    Some((broker, heard, wire))
}

#[test]
fn what_came_while_the_broker_was_away_comes_in_order() {
    let folder = folder("away");
    let Some((_broker, heard, wire)) = behind_a_cut_wire("fleet away", &folder) else { return };
    let (gateway, metrics) = (Gateway::new(), free_port());
    let text = configuration(&gateway, wire.port(), &folder, 10)
        + &format!("[prometheus]\nlisten = \"127.0.0.1:{metrics}\"\n");
    let mut told = 0;
    let mut tell_until = |last: u32| {
        while told < last {
            told += 1;
            gateway.angle(0, &format!("0.{told:03}"), 1, told);
            thread::sleep(Duration::from_millis(10));
        }
    };
    let bridge = Program::bridge(&folder, &text);
    gateway.wait_for(1);
    gateway.end_line();
    tell_until(101);
    until("the last value of the first run", || {
        get(metrics, "/metrics").filter(|(_, text)| text.contains("} 0.101\n"))
    });
    assert!(bridge.end().success());
    let bridge = Program::bridge(&folder, &text);
    gateway.wait_for(2);
    gateway.end_line();
    tell_until(150);
    wire.mend();
    tell_until(200);
    until("the last value", || (outcomes(&heard.all()).last() == Some(&200)).then_some(()));
    assert_eq!(outcomes(&heard.all()), (1..=200).collect::<Vec<_>>());
    drop(bridge);
}

#[test]
fn a_bridge_that_is_killed_loses_at_most_a_second() {
    let folder = folder("killed");
    let Some((_broker, heard, wire)) = behind_a_cut_wire("fleet killed", &folder) else { return };
    let gateway = Gateway::new();
    let text = configuration(&gateway, wire.port(), &folder, 10);
    let bridge = Program::bridge(&folder, &text);
    gateway.wait_for(1);
    gateway.end_line();
    let mut told = Vec::new();
    for n in 1..=200 {
        gateway.angle(0, "1.000", 1, n);
        told.push(Instant::now());
        thread::sleep(Duration::from_millis(15));
    }
    let killed = Instant::now();
    bridge.kill();
    wire.mend();
    let _bridge = Program::bridge(&folder, &text);
    gateway.wait_for(2);
    gateway.end_line();
    gateway.angle(0, "1.000", 1, 1_000);
    until("the last value", || (outcomes(&heard.all()).last() == Some(&1_000)).then_some(()));
    let mut got = outcomes(&heard.all());
    got.pop();
    assert_eq!(got, (1..=got.len() as u64).collect::<Vec<_>>());
    // A busy computer is given half a second more than the promise.
    let oldest = told.get(got.len()).map_or(Duration::ZERO, |at| killed - *at);
    assert!(
        oldest <= Duration::from_millis(1_500),
        "lost from {} on, the oldest {oldest:?} old",
        got.len() + 1
    );
    // Numbers of messages go on, whatever was lost.
    let numbers: Vec<_> = heard
        .all()
        .iter()
        .filter(|heard| heard.topic == "clino/north/state")
        .map(|heard| heard.json()["seq"].as_u64().expect("a number"))
        .collect();
    assert!(
        numbers.is_sorted()
            && numbers.first().map(|n| n >> 32) == Some(1)
            && numbers.last().map(|n| n >> 32) == Some(2),
        "{numbers:?}"
    );
}
