//! A bench that leads an operation to its end, and nodes that can be spoilt at one place.

#![allow(dead_code, reason = "each test file uses its own part")]

pub mod isu;
pub mod spoil;
pub mod t7;

use std::fmt::Debug;

use clino_bus::{Duration, Protocol, Serial, Timing, earliest};
use clino_commissioning::{Commissionable, Operation, Runner, RunnerAction};
use clino_segment::chance::Chance;
use clino_segment::{Noise, SegmentSettings};
use clino_testkit::rig::Bench;

pub const MS: u64 = 1_000_000;
pub const SECOND: u64 = 1_000_000_000;

/// No operation under test takes longer than this.
const LIMIT: Duration = Duration::from_micros(60_000_000);

pub fn quiet() -> SegmentSettings {
    SegmentSettings { chance: Chance::new(1), echo: false, noise: Noise::default() }
}

/// What an operation did.
#[derive(Debug)]
pub struct Run<V, R, E> {
    pub result: Result<R, E>,
    pub events: Vec<V>,
    /// Requests sent.
    pub requests: u32,
    /// Bit rates the line was set to, in order.
    pub rates: Vec<u32>,
    pub took: Duration,
}

pub type RunOf<O> = Run<<O as Operation>::Event, <O as Operation>::Report, <O as Operation>::Error>;

/// A protocol with the waits for a bit rate.
pub trait Timed: Protocol {
    fn timing(serial: Serial) -> Timing;
}

impl Timed for clino_bus::T7 {
    fn timing(serial: Serial) -> Timing {
        Timing::t7(serial)
    }
}

impl Timed for clino_bus::Isu {
    fn timing(_: Serial) -> Timing {
        Timing::isu()
    }
}

impl Timed for clino_commissioning::isu::raw::UnprotectedIsu {
    fn timing(_: Serial) -> Timing {
        Timing::isu()
    }
}

/// Leads an operation to its end.
pub fn run<O>(bench: &mut Bench<O::Protocol>, operation: O) -> RunOf<O>
where
    O: Operation,
    O::Protocol: Commissionable + Timed,
    O::Report: Debug,
    O::Error: Debug,
{
    run_and(bench, operation, |_, _| {})
}

/// As [`run`]; `look` sees the runner before every step and may cancel.
pub fn run_and<O>(
    bench: &mut Bench<O::Protocol>,
    operation: O,
    mut look: impl FnMut(&mut Runner<O>, u32),
) -> RunOf<O>
where
    O: Operation,
    O::Protocol: Commissionable + Timed,
    O::Report: Debug,
    O::Error: Debug,
{
    let mut runner = Runner::new(operation);
    let (mut events, mut requests, mut rates) = (Vec::new(), 0, Vec::new());
    let begun = bench.port.now();
    loop {
        let now = bench.port.now();
        assert!(now.since(begun) < LIMIT, "it does not end: {:?}", runner.progress());
        while let Some(outcome) = bench.master.poll(now) {
            events.extend(runner.settle(&outcome));
        }
        look(&mut runner, requests);
        let progress = runner.progress();
        assert!(progress.done <= progress.of, "{progress:?}");
        match runner.poll(&mut bench.master, now) {
            RunnerAction::Send(frame) => {
                requests += 1;
                let give_up = now + bench.master.timing().line_busy;
                bench.port.submit(frame.as_ref(), give_up).expect("the line is idle");
            }
            RunnerAction::Serial(serial) => {
                rates.push(serial.baud);
                let timing = O::Protocol::timing(serial);
                bench.port.set_serial(serial, timing.guard);
                bench.master.set_timing(timing);
                continue;
            }
            RunnerAction::Done(result) => {
                return Run { result, events, requests, rates, took: now.since(begun) };
            }
            RunnerAction::Idle => {}
        }
        let at = earliest(bench.master.poll_at(), runner.poll_at().filter(|&at| at > now));
        let at = at.unwrap_or(now + Duration::from_micros(1_000)).max(now + Duration::from_micros(1));
        if let Some(event) = bench.port.run(at) {
            events.extend(bench.master.on(event).and_then(|outcome| runner.settle(&outcome)));
        }
    }
}

/// Lets time pass on the line without a request.
pub fn idle_for<P: Protocol>(bench: &mut Bench<P>, time: Duration) {
    let until = bench.port.now() + time;
    while bench.port.now() < until {
        let _ = bench.master.poll(bench.port.now());
        if let Some(event) = bench.port.run(until) {
            let _ = bench.master.on(event);
        }
    }
    let _ = bench.master.poll(bench.port.now());
}
