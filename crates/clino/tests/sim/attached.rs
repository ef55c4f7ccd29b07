//! `clino sim --port`: the sensors at one end of a cable, the tool at the other.

use std::fs::File;
use std::io::ErrorKind;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use clino_pty::Terminal;

use super::port::Port;
use super::server::{CLINO, PATIENCE, Server, Signal, keep_number};
use super::{ASK_3, ASK_5, SAYS_3, SAYS_5};

/// A look at both ends.
const LOOK: Duration = Duration::from_micros(500);

/// Two ports with a cable between, as two adapters on one pair.
struct Cable {
    ends: [String; 2],
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Cable {
    /// Both ends at this bit rate: at different ones nothing passes. With `echo` the first end hears itself.
    fn new(baud: u32, echo: bool) -> Self {
        let mut terminals = [Terminal::open(baud).unwrap(), Terminal::open(baud).unwrap()];
        let ends = [terminals[0].path().to_owned(), terminals[1].path().to_owned()];
        let stop = Arc::new(AtomicBool::new(false));
        let ended = Arc::clone(&stop);
        let carry = move || {
            let mut buffer = [0; 256];
            while !ended.load(Ordering::SeqCst) {
                for from in 0..2 {
                    let bytes = terminals[from].read(&mut buffer).unwrap().to_vec();
                    if echo && from == 0 {
                        terminals[0].deliver(&bytes).unwrap();
                    }
                    let [one, other] = [0, 1].map(|end: usize| terminals[end].baud().unwrap());
                    let passes = if one == other { &bytes[..] } else { &[] };
                    terminals[1 - from].deliver(passes).unwrap();
                }
                thread::sleep(LOOK);
            }
        };
        Self { ends, stop, thread: Some(thread::spawn(carry)) }
    }
}

impl Drop for Cable {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::SeqCst);
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

#[test]
fn sensors_answer_on_a_port_with_and_without_an_echo() {
    for echo in [false, true] {
        for (sensors, baud, ask, says) in [
            ("--t7 5,angle=12.345 --t7 6", 115_200, &ASK_5[..], &SAYS_5[..]),
            ("--isu 3,angle=90 --isu 4", 9_600, &ASK_3[..], &SAYS_3[..]),
        ] {
            let cable = Cable::new(baud, echo);
            let server = Server::start(&format!("{sensors} --port {}", cable.ends[0]));
            assert_eq!(server.path(), cable.ends[0], "it is printed when they listen");
            let mut port = Port::open(&cable.ends[1]);
            for _ in 0..5 {
                assert_eq!(port.ask(ask, says.len()), says, "{sensors} echo {echo}");
            }
            // In two pieces.
            port.send(&ask[..2]);
            thread::sleep(Duration::from_millis(20));
            assert_eq!(port.ask(&ask[2..], says.len()), says, "{sensors} echo {echo}");
            assert_eq!(port.read_within(1, Duration::from_millis(100)), b"", "{sensors} echo {echo}");
            assert_eq!(server.stop(Signal::TERM), (Some(0), vec![]), "{sensors}");
        }
    }
}

#[test]
fn the_simulation_adds_no_more_than_a_character_to_the_latency() {
    // Sensor 25 ms; without running ahead an ISU's command and answer would add 11.5 ms to it.
    let cable = Cable::new(9_600, false);
    let server = Server::start(&format!("--isu 3,latency=25ms --port {}", cable.ends[0]));
    server.path();
    let mut port = Port::open(&cable.ends[1]);
    port.ask(&ASK_3, 6);
    let took = (0..20).map(|_| {
        let asked = Instant::now();
        port.send(&ASK_3);
        port.read(1);
        let first = asked.elapsed();
        port.read(5);
        thread::sleep(Duration::from_millis(20));
        first
    });
    let took = took.min().unwrap();
    let [least, most] = [25, 25 + 6].map(Duration::from_millis);
    assert!((least..most).contains(&took), "{took:?}");
}

#[test]
fn the_port_follows_the_bit_rate_of_the_first_sensor() {
    let cable = Cable::new(115_200, false);
    let server = Server::start(&format!("--t7 5,angle=12.345 --t7 6 --port {}", cable.ends[0]));
    server.path();
    let run = |line: &str| {
        let line = format!("{line} --latency 80 --json --port {}", cable.ends[1]);
        let output = Command::new(CLINO).args(line.split_whitespace()).stdin(Stdio::null()).output().unwrap();
        (output.status.code(), String::from_utf8(output.stdout).unwrap())
    };
    let (status, said) = run("t7 baud 5 9600 --yes");
    assert_eq!(status, Some(0), "{said}");
    let (status, said) = run("t7 angle 5 --baud 9600");
    assert!(status == Some(0) && said.contains("12.345"), "{said}");
    // The other one is at a rate which the port has no more.
    let (status, said) = run("t7 angle 6");
    assert_eq!(status, Some(1), "{said}");
}

#[test]
fn what_cannot_be_served_is_refused() {
    let run = |line: &str| {
        let output = Command::new(CLINO).arg("sim").args(line.split_whitespace()).output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    for (line, status, part) in [
        ("--t7 5 --isu 3 --port /dev/ttyX", 2, "one protocol on a port"),
        ("--t7 5 --pty --port /dev/ttyX", 2, "cannot be used with"),
        ("--t7 5 --port /dev/there-is-no-such-port", 3, "next: plug the adapter in"),
        ("--t7 5 --pty --rts-de", 2, "cannot be used with"),
        ("--t7 5 --port tcp://127.0.0.1:1", 3, "no server answers"),
    ] {
        let (got, said) = run(line);
        assert_eq!(got, Some(status), "{line}: {said}");
        assert!(said.contains(part), "{line}: {said}");
    }
    assert_eq!(File::open("/dev/there-is-no-such-port").unwrap_err().kind(), ErrorKind::NotFound);
}

#[test]
fn a_port_that_vanishes_ends_it_with_a_next_step() {
    let terminal = Terminal::open(115_200).unwrap();
    let line = format!("sim --t7 5 --port {}", terminal.path());
    let mut child = Command::new(CLINO)
        .args(line.split_whitespace())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let deadline = Instant::now() + PATIENCE;
    let mut terminal = Some(terminal);
    while child.try_wait().unwrap().is_none() {
        assert!(Instant::now() < deadline);
        thread::sleep(Duration::from_millis(300));
        if let Some(terminal) = terminal.take() {
            keep_number(terminal.path());
        }
    }
    let output = child.wait_with_output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(said.contains("next: ") && !said.contains("panicked"), "{said}");
}
