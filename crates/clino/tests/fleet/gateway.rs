//! A gateway's console that is made up here: a TCP server that writes what the test wants, and keeps what it was asked.

use std::io::{BufRead as _, BufReader, Write as _};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

/// A gateway.
pub struct Gateway {
    port: u16,
    streams: Arc<Mutex<Vec<TcpStream>>>,
    asked: Arc<Mutex<Vec<String>>>,
    is_over: Arc<std::sync::atomic::AtomicBool>,
}

impl Gateway {
    /// One that answers `version` and `reset-cause` as its second start since its third power-up.
    pub fn new() -> Gateway {
        Gateway::at(0)
    }

    /// The same at a port.
    pub fn at(port: u16) -> Gateway {
        let listener = crate::until("the port of a gateway", || TcpListener::bind(("127.0.0.1", port)).ok());
        let port = listener.local_addr().expect("it is bound").port();
        let (streams, asked) = (Arc::default(), Arc::default());
        let is_over = Arc::new(std::sync::atomic::AtomicBool::new(false));
        let gateway = Gateway { port, streams, asked, is_over };
        let (streams, asked, is_over) =
            (gateway.streams.clone(), gateway.asked.clone(), gateway.is_over.clone());
        thread::spawn(move || {
            for stream in listener.incoming().map_while(Result::ok) {
                if is_over.load(std::sync::atomic::Ordering::Relaxed) {
                    return;
                }
                let _ = stream.set_nodelay(true);
                let reader = stream.try_clone().expect("a stream");
                streams.lock().expect("no panic").push(stream);
                let asked = asked.clone();
                thread::spawn(move || answer(reader, &asked));
            }
        });
        gateway
    }

    pub fn port(&self) -> u16 {
        self.port
    }

    /// Its place in a configuration.
    pub fn endpoint(&self) -> String {
        format!("tcp://127.0.0.1:{}", self.port)
    }

    /// Waits until this many connections have been made.
    pub fn wait_for(&self, connections: usize) {
        crate::until("a connection to the gateway", || {
            (self.streams.lock().expect("no panic").len() >= connections).then_some(())
        });
    }

    /// Writes lines to whoever is connected.
    pub fn say(&self, lines: &str) {
        for stream in self.streams.lock().expect("no panic").iter_mut() {
            for line in lines.lines() {
                // Whoever has gone does not hear it.
                let _ = stream.write_all(format!("{}\r\n", line.trim()).as_bytes());
            }
        }
    }

    /// Ends the line that was begun before the listener came.
    pub fn end_line(&self) {
        self.say("\n");
    }

    /// Right readings of slot 0, each with an angle of its own: that of `seq`, after `last`, is as many thousandths.
    pub fn angles(&self, count: u32, last: &mut u32, age_ms: u64, every: Duration) {
        for _ in 0..count {
            *last += 1;
            self.angle(0, &format!("{}.{:03}", *last / 1_000, *last % 1_000), age_ms, *last);
            thread::sleep(every);
        }
    }

    /// A reading that is right.
    pub fn angle(&self, slot: u16, degrees: &str, age_ms: u64, seq: u32) {
        self.say(&format!(
            r#"{{"slot":{slot},"kind":"t7","bus":"t7","address":{},"status":"ok","angle_deg":{degrees},"age_ms":{age_ms},"health":[],"seq":{seq}}}"#,
            slot + 1
        ));
    }

    /// A reading that is none.
    pub fn no_angle(&self, slot: u16, status: &str, seq: u32) {
        self.say(&format!(
            r#"{{"slot":{slot},"kind":"t7","bus":"t7","address":{},"status":"{status}","angle_deg":null,"age_ms":null,"health":[],"seq":{seq}}}"#,
            slot + 1
        ));
    }

    /// What it was asked.
    pub fn asked(&self) -> Vec<String> {
        self.asked.lock().expect("no panic").clone()
    }

    /// Closes all connections, and lets no new one in.
    pub fn vanish(self) {}
}

impl Drop for Gateway {
    fn drop(&mut self) {
        self.is_over.store(true, std::sync::atomic::Ordering::Relaxed);
        for stream in self.streams.lock().expect("no panic").drain(..) {
            let _ = stream.shutdown(Shutdown::Both);
        }
        // Wakes up the listener, which ends.
        let _ = TcpStream::connect(("127.0.0.1", self.port));
    }
}

/// Lines as `docs/console.md` has them.
fn answer(stream: TcpStream, asked: &Mutex<Vec<String>>) {
    let mut writer = stream.try_clone().expect("a stream");
    for line in BufReader::new(stream).split(b'\r').map_while(Result::ok) {
        let line = String::from_utf8_lossy(&line).trim().to_owned();
        let answer = match line.as_str() {
            "version" => {
                r#"{"what":"clino","version":"0.1.0","uptime_ms":5000,"mode":"normal","clock":"crystal","power_ups":3,"boots":2,"uid":"f23b6837b74ef7e7b94c54b5"}"#
            }
            "reset-cause" => {
                r#"{"what":"start","cause":"watchdog","boots":2,"crashes":1,"mode":"normal","clock":"crystal"}"#
            }
            "watch" => "",
            "t7 scan" => {
                "{\"progress\":\"t7\",\"done\":50,\"of\":101}\r\n{\"what\":\"found\",\"address\":5}\r\n{\"what\":\"swept\",\"devices\":1}"
            }
            _ => r#"{"done":true}"#,
        };
        asked.lock().expect("no panic").push(line);
        let _ = writer.write_all(format!("{answer}\r\n").as_bytes());
    }
}
