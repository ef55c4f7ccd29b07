//! The broker is away, and the bridge is killed: what was told arrives, in order, once it is back.

use std::collections::BTreeSet;
use std::thread;
use std::time::{Duration, Instant};

use crate::broker::{Broker, Heard, mosquitto};
use crate::gateway::Gateway;
use crate::program::Program;
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
fn outcomes(heard: &[Heard]) -> Vec<u64> {
    let mut seen = BTreeSet::new();
    let batches = heard.iter().filter(|heard| heard.topic == "clino/north/state").map(Heard::json);
    let fresh = batches.filter(|batch| seen.insert(batch["seq"].as_u64().expect("a number")));
    fresh
        .flat_map(|batch| batch["values"].as_array().expect("a list").clone())
        .filter(|value| value["status"] == "ok")
        .map(|value| value["outcome"].as_u64().expect("a number"))
        .collect()
}

#[test]
fn what_came_while_the_broker_was_away_comes_in_order() {
    let Some(mosquitto) = mosquitto("fleet away") else { return };
    let folder = folder("away");
    let port = free_port();
    let gateway = Gateway::new();
    let bridge = Program::bridge(&folder, &configuration(&gateway, port, &folder, 10));
    gateway.wait_for(1);
    gateway.end_line();
    for n in 1..=100 {
        gateway.angle(0, "1.000", 1, n);
        thread::sleep(Duration::from_millis(15));
    }
    // The disk has them.
    assert!(bridge.end().success());
    let bridge = Program::bridge(&folder, &configuration(&gateway, port, &folder, 10));
    gateway.wait_for(2);
    gateway.end_line();
    for n in 101..=150 {
        gateway.angle(0, "1.000", 1, n);
        thread::sleep(Duration::from_millis(15));
    }
    let broker = Broker::start_with(&mosquitto, &folder, port, "allow_anonymous true\n");
    let heard = broker.listen(&mosquitto);
    // The listener comes late: a bridge that is quicker would have told it all already. So the broker goes again.
    for n in 151..=200 {
        gateway.angle(0, "1.000", 1, n);
        thread::sleep(Duration::from_millis(15));
    }
    until("the last value", || (outcomes(&heard.all()).last() == Some(&200)).then_some(()));
    let got = outcomes(&heard.all());
    assert!(got.windows(2).all(|pair| pair[1] == pair[0] + 1), "{got:?}");
    drop(bridge);
}

#[test]
fn a_bridge_that_is_killed_loses_at_most_a_second() {
    let Some(mosquitto) = mosquitto("fleet killed") else { return };
    let folder = folder("killed");
    let port = free_port();
    let gateway = Gateway::new();
    let bridge = Program::bridge(&folder, &configuration(&gateway, port, &folder, 10));
    gateway.wait_for(1);
    gateway.end_line();
    let mut told = Vec::new();
    for n in 1..=200 {
        gateway.angle(0, "1.000", 1, n);
        told.push((Instant::now(), u64::from(n)));
        thread::sleep(Duration::from_millis(15));
    }
    let killed = Instant::now();
    bridge.kill();
    let broker = Broker::start_with(&mosquitto, &folder, port, "allow_anonymous true\n");
    let heard = broker.listen(&mosquitto);
    let _bridge = Program::bridge(&folder, &configuration(&gateway, port, &folder, 10));
    gateway.wait_for(2);
    gateway.end_line();
    gateway.angle(0, "1.000", 1, 1_000);
    until("the last value", || (outcomes(&heard.all()).last() == Some(&1_000)).then_some(()));
    let got = outcomes(&heard.all());
    assert!(got.is_sorted(), "{got:?}");
    let missing: Vec<_> = told.iter().filter(|(_, n)| !got.contains(n)).collect();
    // A busy computer is given half a second more than the promise.
    let oldest = missing.first().map_or(Duration::ZERO, |(at, _)| killed - *at);
    assert!(
        oldest <= Duration::from_millis(1_500),
        "lost {} values, the oldest {oldest:?} old",
        missing.len()
    );
    assert!(got.len() > 60, "{got:?}");
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
