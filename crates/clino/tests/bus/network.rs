//! Over TCP: a bridge of this test, and the ser2net of the distribution if the computer has it.

use std::io::{ErrorKind, Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Stdio};
use std::thread;
use std::time::Duration;

use clino_testkit::programs::{Ser2net, skipped};

use super::port::Port;
use super::server::Server;
use super::{json, patiently, what};

/// Passes bytes between the connections to a socket, one after another, and a port.
fn bridge(sensors: &str) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let sensors = sensors.to_owned();
    thread::spawn(move || {
        for stream in listener.incoming().map_while(Result::ok) {
            let mut port = Port::open(&sensors);
            pass(stream, &mut port);
        }
    });
    format!("tcp://{address}")
}

fn pass(mut stream: TcpStream, port: &mut Port) {
    stream.set_read_timeout(Some(Duration::from_millis(1))).unwrap();
    let mut buffer = [0; 256];
    loop {
        match stream.read(&mut buffer) {
            Ok(0) => return,
            Ok(count) => port.send(&buffer[..count]),
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            Err(_) => return,
        }
        if stream.write_all(&port.read_within(256, Duration::from_millis(1))).is_err() {
            return;
        }
    }
}

/// Reads and writes a sensor behind this port.
fn works(port: &str) {
    let done = |line: &str, expected: &str| {
        patiently(|| match json(port, line) {
            (0, objects) => Ok(what(&objects, expected).clone()),
            (status, objects) => Err(format!("{port}, {line}: {status} {objects:?}")),
        })
    };
    assert_eq!(done("t7 angle 5", "angle")["angle_deg"], 12.345);
    assert_eq!(done("t7 damping 5 500 --yes", "changed")["from"], 1000);
    assert_eq!(done("t7 info 5", "identity")["damping_ms"], 500);
}

#[test]
fn a_sensor_behind_a_tcp_bridge() {
    let server = Server::start("--t7 5,angle=12.345 --pty");
    works(&bridge(&server.path()));
}

#[test]
fn the_bit_rate_of_a_server_is_its_own() {
    let server = Server::start("--t7 5,angle=12.345 --pty");
    let port = bridge(&server.path());
    for line in ["t7 scan all", "t7 baud 5 9600 --yes"] {
        let (status, objects) = json(&port, line);
        assert_eq!((status, &objects[0]["error"]["kind"]), (3, &"fixed_rate".into()), "{line}: {objects:?}");
    }
    // Nothing was written.
    works(&port);
}

#[test]
fn no_server_is_an_error_with_a_next_step() {
    // A port that was free a moment ago.
    let address = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let (status, objects) = json(&format!("tcp://{address}"), "t7 angle 5");
    assert_eq!((status, &objects[0]["error"]["kind"]), (3, &"no_server".into()), "{objects:?}");
    for (flag, kind) in [("--rts-de", "no_rts"), ("--rs485", "no_rs485")] {
        let (status, objects) = json(&format!("tcp://{address}"), &format!("t7 angle 5 {flag}"));
        assert_eq!((status, &objects[0]["error"]["kind"]), (3, &kind.into()), "{objects:?}");
    }
}

/// Ended with the test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn a_sensor_behind_ser2net() {
    let ser2net = match Ser2net::get(Path::new(env!("CARGO_TARGET_TMPDIR"))) {
        Ok(ser2net) => ser2net,
        Err(why) => {
            let why = format!("no ser2net 4 on this computer, and none to be had with apt-get: {why}");
            return skipped("a_sensor_behind_ser2net", &why);
        }
    };
    let server = Server::start("--t7 5,angle=12.345 --pty");
    let device = server.path();
    let free = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let settings = format!(
        "connection: &sensors\n  accepter: tcp,127.0.0.1,{free}\n  connector: serialdev,{device},115200n81,local\n"
    );
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("ser2net-{}.yaml", std::process::id()));
    std::fs::write(&file, settings).unwrap();
    // In the foreground, without a lock file of its own.
    let mut command = ser2net.command();
    command.args(["-n", "-d", "-u", "-c"]).arg(&file);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    let running = Running(command.spawn().unwrap());
    let port = format!("tcp://127.0.0.1:{free}");
    works(&port);
    let (status, objects) = json(&port, "t7 scan all");
    assert_eq!((status, &objects[0]["error"]["kind"]), (3, &"fixed_rate".into()), "{objects:?}");
    drop(running);
    std::fs::remove_file(&file).unwrap();
}
