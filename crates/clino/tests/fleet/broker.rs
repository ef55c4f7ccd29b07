//! A real broker, and its own client listening to everything.

use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread;

use clino_testkit::programs::{Mosquitto, skipped};
use serde_json::Value;

/// A broker.
pub struct Broker {
    child: Child,
    port: u16,
    folder: PathBuf,
}

/// A message as the client got it.
#[derive(Clone, Debug)]
pub struct Heard {
    pub topic: String,
    pub payload: Vec<u8>,
}

impl Heard {
    /// As JSON.
    pub fn json(&self) -> Value {
        serde_json::from_slice(&self.payload)
            .unwrap_or_else(|why| panic!("{}: {why}: {}", self.topic, String::from_utf8_lossy(&self.payload)))
    }
}

/// The broker's programs, or a loud skip of this test.
pub fn mosquitto(test: &str) -> Option<Mosquitto> {
    Mosquitto::get(crate::programs()).map_err(|why| skipped(test, &why)).ok()
}

impl Broker {
    /// Starts one at a free port.
    pub fn start(mosquitto: &Mosquitto, folder: &Path) -> Broker {
        Broker::start_with(mosquitto, folder, crate::free_port(), "allow_anonymous true\n")
    }

    /// Starts one at this port with this configuration.
    pub fn start_with(mosquitto: &Mosquitto, folder: &Path, port: u16, more: &str) -> Broker {
        let file = folder.join("mosquitto.conf");
        // Without limits, so that whatever is missing is the bridge's fault.
        let text = format!(
            "listener {port} 127.0.0.1\nmax_queued_messages 0\nmax_inflight_messages 0\nset_tcp_nodelay true\n{more}"
        );
        std::fs::write(&file, text).expect("a folder of this test");
        let mut command = mosquitto.broker();
        command.arg("-c").arg(&file).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        let broker =
            Broker { child: command.spawn().expect("mosquitto starts"), port, folder: folder.to_owned() };
        crate::until("the broker", || std::net::TcpStream::connect(("127.0.0.1", port)).ok());
        broker
    }

    pub fn port(&self) -> u16 {
        self.port
    }

    /// Listens to everything from now on.
    pub fn listen(&self, mosquitto: &Mosquitto) -> Listener {
        let mut command = mosquitto.subscriber();
        // Topic and the payload in hexadecimal, so that any payload is one line.
        command.args(["-h", "127.0.0.1", "-p", &self.port.to_string(), "-q", "1", "-t", "#", "-F", "%t %x"]);
        Listener::start(command, &self.folder, "127.0.0.1", self.port, mosquitto)
    }
}

impl Drop for Broker {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A client that listens.
pub struct Listener {
    child: Child,
    heard: Arc<Mutex<Vec<Heard>>>,
}

impl Listener {
    fn start(mut command: Command, _: &Path, host: &str, port: u16, mosquitto: &Mosquitto) -> Listener {
        let mut child =
            command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn().expect("mosquitto_sub starts");
        let out = child.stdout.take().expect("it is piped");
        let heard: Arc<Mutex<Vec<Heard>>> = Arc::default();
        let to = heard.clone();
        thread::spawn(move || {
            for line in BufReader::new(out).lines().map_while(Result::ok) {
                to.lock().expect("no panic").extend(parse(&line));
            }
        });
        let listener = Listener { child, heard };
        // It has subscribed when it hears something.
        crate::until("the listener", || {
            let mut publisher = mosquitto.publisher();
            let _ =
                publisher.args(["-h", host, "-p", &port.to_string(), "-t", "test/begin", "-m", "x"]).status();
            listener.all().iter().any(|heard| heard.topic == "test/begin").then_some(())
        });
        listener
    }

    /// Everything that was heard.
    pub fn all(&self) -> Vec<Heard> {
        self.heard.lock().expect("no panic").clone()
    }

    /// What was heard of a topic.
    pub fn of(&self, topic: &str) -> Vec<Heard> {
        self.all().into_iter().filter(|heard| heard.topic == topic).collect()
    }

    /// Waits for a message of a topic that is as wanted.
    pub fn wait(&self, topic: &str, is_wanted: impl Fn(&Value) -> bool) -> Value {
        let mut last = Vec::new();
        let begun = std::time::Instant::now();
        loop {
            let heard = self.of(topic);
            if let Some(found) = heard.iter().map(Heard::json).find(|value| is_wanted(value)) {
                return found;
            }
            if let Some(heard) = heard.last() {
                last.clone_from(&heard.payload);
            }
            assert!(
                begun.elapsed() < crate::PATIENCE,
                "{topic}: last was {}",
                String::from_utf8_lossy(&last)
            );
            thread::sleep(std::time::Duration::from_millis(20));
        }
    }
}

impl Drop for Listener {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A line of `-F "%t %x"`: topic, hexadecimal digits.
fn parse(line: &str) -> Option<Heard> {
    let (topic, digits) = line.split_once(' ').unwrap_or((line, ""));
    let payload =
        digits.as_bytes().chunks(2).map(|pair| u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok());
    Some(Heard { topic: topic.to_owned(), payload: payload.collect::<Option<_>>()? })
}
