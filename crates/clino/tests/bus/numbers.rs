//! How fast the tool is, as a ratio to what the bus allows, measured in the same run. `crates/clino/checks/pc.sh` runs it with
//! the tool of a release; a computer that is busy with something else makes the figures worse.

use std::io::{BufRead as _, BufReader};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

use super::adapter::{Adapter, Faults};
use super::common::{measured, run};
use super::port::Port;
use super::server::Server;

const ASK: [u8; 3] = [0x05, 0x01, 0x83];
const ANSWER: usize = 8;
/// How long readings are counted.
const SPAN: Duration = Duration::from_secs(4);
/// Batches of an FTDI as it comes.
const BATCH: Duration = Duration::from_millis(16);
/// The best of this many at most: the others were disturbed. The first good one is enough.
const ATTEMPTS: usize = 10;

/// A figure and its limit.
struct Figure {
    name: &'static str,
    value: f64,
    unit: &'static str,
    limit: f64,
    /// More is better.
    is_least: bool,
}

impl Figure {
    /// At least this much.
    fn least(name: &'static str, limit: f64, unit: &'static str, measure: impl FnMut() -> f64) -> Self {
        Self { name, value: f64::NEG_INFINITY, unit, limit, is_least: true }.measured(measure)
    }

    /// This much at most.
    fn most(name: &'static str, limit: f64, unit: &'static str, measure: impl FnMut() -> f64) -> Self {
        Self { name, value: f64::INFINITY, unit, limit, is_least: false }.measured(measure)
    }

    fn measured(mut self, mut measure: impl FnMut() -> f64) -> Self {
        for _ in 0..ATTEMPTS {
            let value = measure();
            self.value = if self.is_least { self.value.max(value) } else { self.value.min(value) };
            if self.is_good() {
                break;
            }
        }
        self.tell();
        self
    }

    fn is_good(&self) -> bool {
        if self.is_least { self.value >= self.limit } else { self.value <= self.limit }
    }

    fn tell(&self) {
        let (sign, verdict) =
            (if self.is_least { ">=" } else { "<=" }, if self.is_good() { "good" } else { "MISSED" });
        println!("{:<58} {:>8.2} {:<7} {sign} {:<6} {verdict}", self.name, self.value, self.unit, self.limit);
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
    let mut child = Command::new(measured())
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

/// Seconds of a command that succeeds; without end if it does not, because the simulated sensor was late, too.
fn seconds(line: &str) -> f64 {
    let began = Instant::now();
    let run = run(&measured(), line);
    if run.status == 0 { began.elapsed().as_secs_f64() } else { f64::INFINITY }
}

/// Part of a core that a process and its threads have used over `SPAN`, in percent.
fn load(line: &str) -> f64 {
    let mut child = Command::new(measured())
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
#[ignore = "measures time: crates/clino/checks/pc.sh runs it alone, with the tool of a release"]
fn figures() {
    let server = Server::of(&measured(), "--t7 5,angle=12.345 --pty");
    let port = server.path();
    let scan = |line: &str, port: &str| seconds(&format!("t7 scan {line} --port {port}"));
    // 3 ms: an FTDI at its shortest timer, 1 ms, and the computer's part.
    let low = "--latency 3";
    let mut figures = vec![
        Figure::least("T7 polling, of the bus limit", 90.0, "%", || polled(&port) / bus_limit(&port) * 100.0),
        Figure::most("scan of 101 addresses, low latency", 1.0, "s", || scan(low, &port)),
        Figure::most("scan of all five rates, low latency", 4.0, "s", || scan(&format!("all {low}"), &port)),
        Figure::most("start to first angle", 150.0, "ms", || {
            seconds(&format!("t7 angle 5 --port {port}")) * 1_000.0
        }),
    ];
    let batched = Adapter::new(&port, 115_200, Faults { batch: BATCH, ..Faults::default() });
    let port = batched.path();
    figures.extend([
        Figure::least("T7 polling, batches of 16 ms, of what they allow", 90.0, "%", || {
            polled(port) / bus_limit(port) * 100.0
        }),
        Figure::most("scan of 101 addresses, batches of 16 ms", 3.0, "s", || scan("", port)),
        Figure::most("scan of all five rates, batches of 16 ms", 15.0, "s", || scan("all", port)),
    ]);
    drop((batched, server));
    let sensors: String = (1..=32).map(|address| format!("--t7 {address},angle=sine:0:30:4s ")).collect();
    let server = Server::of(&measured(), &format!("{sensors}--pty"));
    let port = server.path();
    let addresses: String = (1..=32).map(|address| format!("{address} ")).collect();
    let file = std::env::temp_dir().join(format!("clino-load-{}.csv", std::process::id()));
    let line = format!("log t7 {addresses}--period 125 --csv {} --port {port}", file.display());
    figures.push(Figure::most("log of 32 sensors at 8 Hz, of a core", 5.0, "%", || load(&line)));
    let rows = std::fs::read_to_string(&file).unwrap().lines().filter(|line| line.contains(",ok,")).count();
    std::fs::remove_file(&file).unwrap();
    assert!(rows > 1_000, "{rows} rows with a value");
    let missed = figures.iter().filter(|figure| !figure.is_good()).count();
    assert_eq!(missed, 0, "figures are beyond their limits");
}
