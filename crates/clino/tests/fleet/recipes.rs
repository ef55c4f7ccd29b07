//! Recipes of `docs/fleet.md` in the programs that they are for. Prometheus and InfluxDB are in `monitors.rs`.

use std::fs::File;
use std::process::Stdio;

use clino_testkit::programs::{Node, skipped};

use crate::broker::{Broker, mosquitto};
use crate::documents::document;
use crate::gateway::Gateway;
use crate::monitors::Running;
use crate::program::Program;
use crate::{folder, free_port, until};

/// The flow of `docs/node-red.json` as it stands, but for the broker's port: its debug node prints each angle that is right.
#[test]
fn node_red_has_a_message_for_each_angle_that_is_right() {
    const TEST: &str = "fleet Node-RED";
    let Some(mosquitto) = mosquitto(TEST) else { return };
    let node = match Node::with(crate::programs(), &["node-red@4.1.8"]) {
        Ok(node) => node,
        Err(why) => return skipped(TEST, &why),
    };
    let folder = folder("node-red");
    let broker = Broker::start(&mosquitto, &folder);
    let gateway = Gateway::new();
    let configuration = format!(
        "[[gateway]]\nname = \"north\"\nconsole = \"{}\"\n[mqtt]\nhost = \"127.0.0.1\"\nport = {}\n[store]\nfolder = \"{}\"\n",
        gateway.endpoint(),
        broker.port(),
        folder.display()
    );
    let _bridge = Program::bridge(&folder, &configuration);
    let flow = document("docs/node-red.json");
    assert_eq!(flow.matches("\"1883\"").count(), 1);
    let flow = flow.replace("\"1883\"", &format!("\"{}\"", broker.port()));
    std::fs::write(folder.join("flows.json"), flow).expect("a folder of this test");
    let log = folder.join("node-red.log");
    let mut command = node.command();
    command.arg(node.module("node-red").join("red.js"));
    command.arg("--userDir").arg(&folder).arg("--port").arg(free_port().to_string());
    command.arg("flows.json").current_dir(&folder).stdin(Stdio::null());
    command.stdout(File::create(&log).expect("a folder of this test"));
    let _running = Running::start_with(&mut command, &folder.join("node-red.errors"));
    gateway.wait_for(1);
    gateway.end_line();
    let mut told = 0;
    let printed = until("Node-RED", || {
        // Its subscription may be later than any message.
        told += 1;
        gateway.angle(0, "-12.345", 1, told);
        gateway.no_angle(1, "no_answer", told);
        let text = std::fs::read_to_string(&log).ok()?;
        (text.matches("north/0").count() > 2).then_some(text)
    });
    assert!(printed.contains("payload: -12.345"), "{printed}");
    assert!(!printed.contains("north/1"), "{printed}");
}
