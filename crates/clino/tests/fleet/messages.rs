//! What the broker carries: values, status, events, discovery.

use serde_json::Value;

use crate::broker::{Broker, mosquitto};
use crate::gateway::Gateway;
use crate::program::Program;
use crate::{folder, now_ms, until};

fn configuration(gateway: &Gateway, port: u16, folder: &std::path::Path, more: &str) -> String {
    format!(
        "[[gateway]]\nname = \"north\"\nconsole = \"{}\"\n[gateway.sensors]\n0 = \"Tower, \\\"east\\\"\"\n\
         [mqtt]\nhost = \"127.0.0.1\"\nport = {port}\nbridge = \"site\"\n{more}\n[store]\nfolder = \"{}\"\n",
        gateway.endpoint(),
        folder.display()
    )
}

/// Values of a batch, by slot.
fn value(batch: &Value, slot: u64) -> Option<&Value> {
    batch["values"].as_array()?.iter().find(|value| value["slot"] == slot)
}

#[test]
fn a_value_is_when_it_was_measured_and_what_is_not_ok_is_none() {
    let Some(mosquitto) = mosquitto("fleet values") else { return };
    let folder = folder("values");
    let broker = Broker::start(&mosquitto, &folder);
    let heard = broker.listen(&mosquitto);
    let gateway = Gateway::new();
    let _bridge = Program::bridge(&folder, &configuration(&gateway, broker.port(), &folder, ""));
    gateway.wait_for(1);
    gateway.say("end of a line that was begun before");
    gateway.angle(0, "-12.345", 60_000, 7);
    let before = now_ms();
    let batch = heard.wait("clino/north/state", |batch| value(batch, 0).is_some());
    let after = now_ms();
    let of_0 = value(&batch, 0).expect("it is there");
    assert_eq!(of_0["angle_deg"].to_string(), "-12.345");
    assert_eq!(
        (&of_0["status"], &of_0["outcome"], &of_0["name"]),
        (&"ok".into(), &7.into(), &"Tower, \"east\"".into())
    );
    let measured = of_0["ts"].as_i64().expect("a number");
    assert!((before - 62_000..after - 59_500).contains(&measured), "{before} {measured} {after}");
    // The gateway was asked who it is.
    let status = heard.wait("clino/north/status", |status| status["boot"] == "3.2");
    assert_eq!(
        (&status["state"], &status["cause"], &status["crashes"]),
        (&"online".into(), &"watchdog".into(), &1.into())
    );
    let start = heard.wait("clino/north/event", |event| event["event"] == "start");
    assert_eq!((&start["boot"], &start["version"]), (&"3.2".into(), &"0.1.0".into()));
    gateway.no_angle(0, "no_answer", 8);
    gateway.no_angle(1, "a_status_of_tomorrow", 1);
    for (slot, word) in [(0, "no_answer"), (1, "a_status_of_tomorrow")] {
        let batch = heard.wait("clino/north/state", |batch| {
            value(batch, slot).is_some_and(|value| value["status"] == word)
        });
        assert_eq!(value(&batch, slot).expect("it is there")["angle_deg"], Value::Null);
    }
    // A line that was damaged on its way tells nothing.
    gateway.say(r#"{"slot":2,"kind":"t7","bus":"t7","address":3,"status":"ok","angle_deg":12.3x5,"age_ms":1,"health":[],"seq":1}"#);
    gateway.angle(3, "1.000", 1, 1);
    heard.wait("clino/north/state", |batch| value(batch, 3).is_some());
    assert!(heard.of("clino/north/state").iter().all(|heard| value(&heard.json(), 2).is_none()));
    // Every message of the gateway has a number of its own, ascending.
    let numbers: Vec<_> = heard
        .all()
        .iter()
        .filter(|heard| ["clino/north/state", "clino/north/event"].contains(&heard.topic.as_str()))
        .map(|heard| heard.json()["seq"].as_u64().expect("a number"))
        .collect();
    assert!(numbers.len() > 4 && numbers.windows(2).all(|pair| pair[1] == pair[0] + 1), "{numbers:?}");
}

#[test]
fn a_gateway_that_goes_takes_its_values_with_it_and_alarms_and_starts_are_told() {
    let Some(mosquitto) = mosquitto("fleet events") else { return };
    let folder = folder("events");
    let broker = Broker::start(&mosquitto, &folder);
    let heard = broker.listen(&mosquitto);
    let gateway = Gateway::new();
    let bridge = Program::bridge(&folder, &configuration(&gateway, broker.port(), &folder, ""));
    gateway.wait_for(1);
    gateway.end_line();
    gateway.angle(0, "1.000", 1, 1);
    gateway.say(r#"{"alarm":0,"name":"high","state":"active","age_ms":7,"extreme":12.345,"unit":"deg","angle_deg":12.345}"#);
    let alarm = heard.wait("clino/north/event", |event| event["event"] == "alarm");
    assert_eq!(
        (&alarm["slot"], &alarm["alarm"], &alarm["state"]),
        (&0.into(), &"high".into(), &"active".into())
    );
    gateway.say(r#"{"stream":"started","version":"0.1.0","uptime_ms":5,"mode":"normal","clock":"crystal","power_ups":4,"boots":1,"uid":"f23b6837b74ef7e7b94c54b5","prompt":"Enter"}"#);
    heard.wait("clino/north/event", |event| event["event"] == "start" && event["boot"] == "4.1");
    let port = gateway.port();
    gateway.vanish();
    heard.wait("clino/north/status", |status| status["state"] == "offline");
    let batch = heard.wait("clino/north/state", |batch| {
        value(batch, 0).is_some_and(|value| value["status"] == "source_gone")
    });
    assert_eq!(value(&batch, 0).expect("it is there")["angle_deg"], Value::Null);
    let gone = heard.wait("clino/north/event", |event| event["event"] == "offline");
    assert!(gone["why"].as_str().is_some_and(|why| why.contains(&port.to_string())), "{gone}");
    // And back.
    let again = Gateway::at(port);
    again.wait_for(1);
    again.end_line();
    again.angle(0, "2.000", 1, 2);
    heard.wait("clino/north/state", |batch| value(batch, 0).is_some_and(|value| value["angle_deg"] == 2.0));
    assert_eq!(heard.of("clino/bridge/site/status").last().expect("a status").payload, b"online");
    assert!(bridge.end().success());
    until("the farewell", || {
        (heard.of("clino/bridge/site/status").last()?.payload == b"offline").then_some(())
    });
}

#[test]
fn a_bridge_that_is_killed_is_offline_by_its_last_will() {
    let Some(mosquitto) = mosquitto("fleet last will") else { return };
    let folder = folder("will");
    let broker = Broker::start(&mosquitto, &folder);
    let heard = broker.listen(&mosquitto);
    let gateway = Gateway::new();
    let bridge = Program::bridge(&folder, &configuration(&gateway, broker.port(), &folder, ""));
    until("the bridge", || (heard.of("clino/bridge/site/status").last()?.payload == b"online").then_some(()));
    bridge.kill();
    until("the will", || (heard.of("clino/bridge/site/status").last()?.payload == b"offline").then_some(()));
}

/// Keys of Home Assistant, restated from its documentation (*MQTT*, device discovery; *MQTT Sensor*).
#[test]
fn home_assistant_finds_each_sensor() {
    let Some(mosquitto) = mosquitto("fleet discovery") else { return };
    let folder = folder("discovery");
    let broker = Broker::start(&mosquitto, &folder);
    let heard = broker.listen(&mosquitto);
    let gateway = Gateway::new();
    let more = "[mqtt.home_assistant]\nevery_ms = 500";
    let _bridge = Program::bridge(&folder, &configuration(&gateway, broker.port(), &folder, more));
    gateway.wait_for(1);
    // Its values are for now or never: they are not kept for a broker that is not there yet.
    until("the bridge", || (heard.of("clino/bridge/site/status").last()?.payload == b"online").then_some(()));
    gateway.end_line();
    gateway.angle(0, "1.500", 1, 1);
    gateway.angle(4, "2.500", 1, 1);
    let topic = "homeassistant/device/clino_north/config";
    let device =
        heard.wait(topic, |device| device["components"].as_object().is_some_and(|all| all.len() == 2));
    assert_eq!(device["device"]["identifiers"], serde_json::json!(["clino_north"]));
    assert!(device["origin"]["name"].is_string());
    assert_eq!(device["availability_mode"], "all");
    let availability = device["availability"].as_array().expect("a list");
    assert_eq!(availability[0]["topic"], "clino/bridge/site/status");
    assert_eq!(availability[1]["topic"], "clino/north/status");
    assert_eq!(availability[1]["value_template"], "{{ value_json.state }}");
    let sensor = &device["components"]["angle_0"];
    assert_eq!((&sensor["platform"], &sensor["unit_of_measurement"]), (&"sensor".into(), &"°".into()));
    assert_eq!(
        (&sensor["name"], &sensor["unique_id"]),
        (&"Tower, \"east\"".into(), &"clino_north_0_angle".into())
    );
    // Three periods of half a second, in whole seconds.
    assert_eq!(sensor["expire_after"], 2);
    let values = sensor["state_topic"].as_str().expect("a topic");
    assert_eq!(heard.wait(values, |_| true)["angle_deg"], 1.5);
    gateway.no_angle(0, "stale", 2);
    std::thread::sleep(std::time::Duration::from_millis(600));
    gateway.no_angle(0, "stale", 3);
    assert_eq!(heard.wait(values, |value| value["status"] == "stale")["angle_deg"], Value::Null);
}

#[test]
fn a_broker_that_refuses_is_told_without_the_password() {
    let Some(mosquitto) = mosquitto("fleet refused") else { return };
    let folder = folder("refused");
    let broker = Broker::start_with(&mosquitto, &folder, crate::free_port(), "allow_anonymous false\n");
    let gateway = Gateway::new();
    let secret = folder.join("password");
    std::fs::write(&secret, "hunter2hunter2\n").expect("a folder of this test");
    let more = format!("user = \"me\"\npassword = {{ file = \"{}\" }}", secret.display());
    let bridge = Program::bridge(&folder, &configuration(&gateway, broker.port(), &folder, &more));
    let said =
        until("the refusal", || Some(bridge.errors()).filter(|said| said.contains("broker 127.0.0.1")));
    assert!(said.contains("NotAuthorized") || said.contains("refused"), "{said}");
    assert!(!said.contains("hunter2"), "{said}");
}

/// Brokers that are none, in both dialects: nothing listens, a server that closes at once, one that speaks something else, one
/// that refuses (CONNACK 5). Each is told, in the log and to Prometheus, without the password.
#[test]
fn a_broker_that_is_none_is_told_without_the_password() {
    use std::io::Write as _;
    let folder = folder("no-broker");
    let secret = folder.join("password");
    std::fs::write(&secret, "hunter2hunter2\n").expect("a folder of this test");
    let server = |greeting: &'static [u8]| {
        let listener = std::net::TcpListener::bind(("127.0.0.1", 0)).expect("loopback");
        let port = listener.local_addr().expect("it is bound").port();
        std::thread::spawn(move || {
            for mut stream in listener.incoming().map_while(Result::ok) {
                let _ = stream.write_all(greeting);
            }
        });
        port
    };
    let ports = [
        crate::free_port(),
        server(b""),
        server(b"HTTP/1.1 400 Bad Request\r\nContent-Length: 0\r\n\r\n"),
        server(b"\x20\x02\x00\x05"),
    ];
    let gateway = Gateway::new();
    for dialect in ["json", "sparkplug"] {
        for (number, port) in ports.into_iter().enumerate() {
            let folder = folder.join(format!("{dialect}-{number}"));
            std::fs::create_dir(&folder).expect("a folder of this test");
            let metrics = crate::free_port();
            let more = format!(
                "dialect = \"{dialect}\"\nuser = \"me\"\npassword = {{ file = \"{}\" }}\n\
                 [prometheus]\nlisten = \"127.0.0.1:{metrics}\"",
                secret.display()
            );
            let bridge = Program::bridge(&folder, &configuration(&gateway, port, &folder, &more));
            let said = until("a reason", || {
                Some(bridge.errors()).filter(|said| said.contains("broker") && said.contains(": "))
            });
            assert!(!said.contains("hunter2"), "{said}");
            until("the gauges", || {
                let (_, text) = crate::metrics::get(metrics, "/metrics")?;
                let is_lost = !text.contains("clino_broker_lost_total 0\n");
                (is_lost && text.contains("clino_broker_connected 0\n")).then_some(())
            });
            assert!(bridge.end().success(), "{dialect} {number}: it ends when it is asked to");
        }
    }
}

/// A password that is wrong, then the right one.
#[test]
fn a_broker_with_passwords_wants_the_right_one() {
    let Some(mosquitto) = mosquitto("fleet password") else { return };
    let folder = folder("password");
    let passwords = folder.join("passwords");
    let mut command = mosquitto.passwords();
    let made = command.args(["-b", "-c"]).arg(&passwords).args(["me", "hunter2hunter2"]).status();
    assert!(made.expect("mosquitto_passwd starts").success());
    // Started by root, the broker would otherwise give up the right to read it. The listener of the test has a door of its own.
    let (open, closed) = (crate::free_port(), crate::free_port());
    let more = format!(
        "user root\nper_listener_settings true\nallow_anonymous true\nlistener {closed} 127.0.0.1\nallow_anonymous false\npassword_file {}\n",
        passwords.display()
    );
    let broker = Broker::start_with(&mosquitto, &folder, open, &more);
    let heard = broker.listen(&mosquitto);
    let gateway = Gateway::new();
    let secret = folder.join("secret");
    for (password, is_right) in [("hunter3hunter3", false), ("hunter2hunter2", true)] {
        std::fs::write(&secret, format!("{password}\n")).expect("a folder of this test");
        let more = format!("user = \"me\"\npassword = {{ file = \"{}\" }}", secret.display());
        let bridge = Program::bridge(&folder, &configuration(&gateway, closed, &folder, &more));
        if is_right {
            until("the bridge", || {
                (heard.of("clino/bridge/site/status").last()?.payload == b"online").then_some(())
            });
        } else {
            until("a refusal", || Some(bridge.errors()).filter(|said| said.contains("broker 127.0.0.1")));
            assert!(heard.of("clino/bridge/site/status").is_empty());
        }
        assert!(!bridge.errors().contains("hunter"), "{}", bridge.errors());
    }
}

/// An authority and a certificate for localhost that it has signed, by `openssl`.
fn certificates(folder: &std::path::Path) -> Result<(), String> {
    let steps = [
        "req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=authority -keyout ca.key -out ca.pem",
        "req -newkey rsa:2048 -nodes -subj /CN=localhost -keyout server.key -out server.csr",
        "x509 -req -in server.csr -CA ca.pem -CAkey ca.key -CAcreateserial -days 2 -extfile names -out server.pem",
        "req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=another -keyout another.key -out another.pem",
    ];
    std::fs::write(folder.join("names"), "subjectAltName=DNS:localhost\n").map_err(|why| why.to_string())?;
    for step in steps {
        let openssl =
            std::process::Command::new("openssl").args(step.split(' ')).current_dir(folder).output();
        let output = openssl.map_err(|why| format!("openssl: {why}"))?;
        if !output.status.success() {
            return Err(clino_testkit::programs::said(&output));
        }
    }
    Ok(())
}

#[test]
fn a_broker_with_tls_is_trusted_by_its_authority_alone() {
    let Some(mosquitto) = mosquitto("fleet TLS") else { return };
    let folder = folder("tls");
    if let Err(why) = certificates(&folder) {
        return clino_testkit::programs::skipped("fleet TLS", &why);
    }
    let (plain, secret) = (crate::free_port(), crate::free_port());
    let file = |name: &str| folder.join(name).display().to_string();
    // Started by root, it would otherwise give up the right to read its key.
    let more = format!(
        "allow_anonymous true\nuser root\nlistener {secret} 127.0.0.1\ncafile {}\ncertfile {}\nkeyfile {}\n",
        file("ca.pem"),
        file("server.pem"),
        file("server.key")
    );
    let broker = Broker::start_with(&mosquitto, &folder, plain, &more);
    let heard = broker.listen(&mosquitto);
    let gateway = Gateway::new();
    for (authority, is_trusted) in [("another.pem", false), ("ca.pem", true)] {
        let more = format!("ca_file = \"{}\"", file(authority));
        let text =
            configuration(&gateway, secret, &folder, &more).replace("127.0.0.1\"\nport", "localhost\"\nport");
        let bridge = Program::bridge(&folder, &text);
        if is_trusted {
            until("the bridge", || {
                (heard.of("clino/bridge/site/status").last()?.payload == b"online").then_some(())
            });
        } else {
            until("a refusal", || Some(bridge.errors()).filter(|said| said.contains("broker localhost")));
            assert!(heard.of("clino/bridge/site/status").is_empty());
        }
    }
}
