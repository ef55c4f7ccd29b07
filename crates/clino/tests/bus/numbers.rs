//! How fast the tool is, as a ratio to what the bus allows, measured in the same run. `crates/clino/checks/pc.sh` runs it with a
//! release build; a computer that is busy with something else makes the figures worse.

use std::io::{BufRead as _, BufReader};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

use super::adapter::{Adapter, Faults};
use super::common::{CLINO, clino};
use super::port::Port;
use super::server::Server;

const ASK: [u8; 3] = [0x05, 0x01, 0x83];
const ANSWER: usize = 8;
/// How long readings are counted.
const SPAN: Duration = Duration::from_secs(4);
/// Batches of an FTDI as it comes.
const BATCH: Duration = Duration::from_millis(16);
/// The best of this many: the others were disturbed.
const ATTEMPTS: usize = 3;

/// A figure and its limit.
struct Figure {
    name: &'static str,
    value: f64,
    unit: &'static str,
    limit: f64,
    /// More is better.
    is_least: bool,
    /// Why the limit is not reached, if that is known; then it is told and does not fail.
    known: Option<&'static str>,
}

impl Figure {
    fn is_good(&self) -> bool {
        if self.is_least { self.value >= self.limit } else { self.value <= self.limit }
    }

    fn tell(&self) {
        let (sign, verdict) =
            (if self.is_least { ">=" } else { "<=" }, if self.is_good() { "good" } else { "MISSED" });
        println!("{:<58} {:>8.2} {:<7} {sign} {:<6} {verdict}", self.name, self.value, self.unit, self.limit);
        if let Some(known) = self.known.filter(|_| !self.is_good()) {
            println!("    {known}");
        }
    }
}

/// Exchanges a second of a program that does nothing else.
fn bus_limit(port: &str) -> f64 {
    let mut port = Port::open(port);
    port.ask(&ASK, ANSWER);
    let (began, mut count) = (Instant::now(), 0);
    while began.elapsed() < SPAN {
        port.ask(&ASK, ANSWER);
        count += 1;
    }
    f64::from(count) / began.elapsed().as_secs_f64()
}

/// Readings a second of `clino watch`.
fn polled(port: &str) -> f64 {
    let line = format!("watch t7 5 --period 0 --json --port {port}");
    let mut child = Command::new(CLINO)
        .args(line.split_whitespace())
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    lines.next();
    let (began, mut count) = (Instant::now(), 0);
    while began.elapsed() < SPAN {
        let line = lines.next().unwrap().unwrap();
        count += u32::from(line.contains("\"status\":\"ok\""));
    }
    let rate = f64::from(count) / began.elapsed().as_secs_f64();
    kill_process(Pid::from_child(&child), Signal::INT).unwrap();
    child.wait().unwrap();
    rate
}

/// The best of some attempts.
fn best(is_least: bool, mut measure: impl FnMut() -> f64) -> f64 {
    let values: Vec<f64> = (0..ATTEMPTS).map(|_| measure()).collect();
    let start = if is_least { f64::NEG_INFINITY } else { f64::INFINITY };
    values.into_iter().fold(start, if is_least { f64::max } else { f64::min })
}

/// Seconds of a command that succeeds; without end if it does not, because the simulated sensor was late, too.
fn seconds(line: &str) -> f64 {
    let began = Instant::now();
    let run = clino(line);
    if run.status == 0 { began.elapsed().as_secs_f64() } else { f64::INFINITY }
}

/// Part of a core that a process and its threads have used over `SPAN`, in percent.
fn load(line: &str) -> f64 {
    let mut child = Command::new(CLINO)
        .args(line.split_whitespace())
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_millis(500));
    // Clock ticks of user and system; a tick is 10 ms on Linux.
    let ticks = || -> f64 {
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", child.id())).unwrap();
        let fields: Vec<&str> = stat.rsplit(')').next().unwrap().split_whitespace().collect();
        fields[11].parse::<f64>().unwrap() + fields[12].parse::<f64>().unwrap()
    };
    let (before, began) = (ticks(), Instant::now());
    std::thread::sleep(2 * SPAN);
    let used = (ticks() - before) / 100.0;
    let load = used / began.elapsed().as_secs_f64() * 100.0;
    kill_process(Pid::from_child(&child), Signal::INT).unwrap();
    child.wait().unwrap();
    load
}

#[test]
#[ignore = "measures time: crates/clino/checks/pc.sh runs it alone, in a release build"]
fn figures() {
    let server = Server::start("--t7 5,angle=12.345 --pty");
    let port = server.path();
    let ratio = best(true, || polled(&port) / bus_limit(&port) * 100.0);
    let faults = || Faults { batch: BATCH, ..Faults::default() };
    let batched = Adapter::new(&port, 115_200, faults());
    let in_batches = best(true, || polled(batched.path()) / bus_limit(batched.path()) * 100.0);
    let first_angle = best(false, || seconds(&format!("t7 angle 5 --port {port}")) * 1_000.0);
    // 3 ms: an FTDI at its shortest timer, 1 ms, and the computer's part.
    let scan = best(false, || seconds(&format!("t7 scan --latency 3 --port {port}")));
    let scan_batched = best(false, || seconds(&format!("t7 scan --port {}", batched.path())));
    let scan_all = best(false, || seconds(&format!("t7 scan all --latency 3 --port {port}")));
    let scan_all_batched = best(false, || seconds(&format!("t7 scan all --port {}", batched.path())));
    drop((batched, server));
    let sensors: String = (1..=32).map(|address| format!("--t7 {address},angle=sine:0:30:4s ")).collect();
    let server = Server::start(&format!("{sensors}--pty"));
    let addresses: String = (1..=32).map(|address| format!("{address} ")).collect();
    let file = std::env::temp_dir().join(format!("clino-load-{}.csv", std::process::id()));
    let line = format!("log t7 {addresses}--period 125 --csv {} --port {}", file.display(), server.path());
    let log = load(&line);
    let rows = std::fs::read_to_string(&file).unwrap().lines().filter(|line| line.contains(",ok,")).count();
    std::fs::remove_file(&file).unwrap();
    assert!(rows > 1_000, "{rows} rows with a value");
    let figure =
        |name, value, unit, limit, is_least| Figure { name, value, unit, limit, is_least, known: None };
    let figures = [
        figure("T7 polling, of the bus limit", ratio, "%", 90.0, true),
        figure("T7 polling, batches of 16 ms, of what they allow", in_batches, "%", 90.0, true),
        figure("scan of 101 addresses, low latency", scan, "s", 1.0, false),
        figure("scan of 101 addresses, batches of 16 ms", scan_batched, "s", 3.0, false),
        Figure {
            known: Some(
                "five changes of the rate cost 550 ms each, in which a T7 forgets what it has heard at another rate (guide \
                 section 1.1: 500 ms), and the dead addresses 2.3 s on the pair alone: 5 s is the least",
            ),
            ..figure("scan of all five rates, low latency", scan_all, "s", 4.0, false)
        },
        figure("scan of all five rates, batches of 16 ms", scan_all_batched, "s", 15.0, false),
        figure("log of 32 sensors at 8 Hz, of a core", log, "%", 5.0, false),
        figure("start to first angle", first_angle, "ms", 150.0, false),
    ];
    figures.iter().for_each(Figure::tell);
    let missed: Vec<_> =
        figures.iter().filter(|figure| !figure.is_good() && figure.known.is_none()).collect();
    assert!(missed.is_empty(), "{} figures are beyond their limits", missed.len());
}
