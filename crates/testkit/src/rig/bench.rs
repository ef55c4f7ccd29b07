//! One request at a time on a simulated segment.

use clino_bus::{Duration, ExchangeOutcome, Instant, Master, Protocol, Timing, earliest, line};
use clino_segment::{Faults, SegmentSettings, Station};
use clino_sim::node::Node;

use super::Port;

/// A master with its port.
pub struct Bench<P: Protocol> {
    /// The UART and the segment.
    pub port: Port,
    /// The master under test.
    pub master: Master<P>,
}

impl<P: Protocol> Bench<P> {
    /// A bench at time 0.
    pub fn new(timing: Timing, settings: SegmentSettings, stations: Vec<Station>) -> Bench<P> {
        Bench::with_line(timing, timing.line(), settings, stations)
    }

    /// A bench at time 0 whose line is set like this.
    pub fn with_line(
        timing: Timing,
        line: line::LineSettings,
        settings: SegmentSettings,
        stations: Vec<Station>,
    ) -> Bench<P> {
        Bench { port: Port::with_line(line, settings, stations), master: Master::new(timing) }
    }

    /// Asks as soon as an answer can be distinguished from late ones, and runs until the exchange has ended.
    ///
    /// # Panics
    /// If the request cannot be encoded, or the exchange does not end.
    pub fn ask(&mut self, address: P::Address, request: &P::Request) -> ExchangeOutcome<P> {
        while let Some(at) = self.master.ask_at(address, request).filter(|&at| at > self.port.now()) {
            assert!(self.run_until(at).is_none(), "nothing was asked");
        }
        self.ask_now(address, request)
    }

    /// Asks at once, and runs until the exchange has ended.
    ///
    /// # Panics
    /// If the request cannot be encoded, an exchange is in hand, or this one does not end.
    pub fn ask_now(&mut self, address: P::Address, request: &P::Request) -> ExchangeOutcome<P> {
        assert!(self.master.ask_at(address, request).is_some(), "an exchange is in hand");
        let now = self.port.now();
        let Ok(frame) = self.master.begin(address, request, now) else { panic!("not a request") };
        let give_up = now + self.master.timing().line_busy;
        self.port.submit(frame.as_ref(), give_up).expect("the line is idle");
        self.run_until(now + Duration::from_millis(10_000)).expect("every exchange ends")
    }

    /// Runs until an exchange has ended, at most until `until`.
    pub fn run_until(&mut self, until: Instant) -> Option<ExchangeOutcome<P>> {
        while self.port.now() < until {
            if let Some(outcome) = self.master.poll(self.port.now()) {
                return Some(outcome);
            }
            let at = earliest(self.master.poll_at(), Some(until)).unwrap_or(until).max(self.port.now());
            if let Some(event) = self.port.run(at)
                && let Some(outcome) = self.master.on(event)
            {
                return Some(outcome);
            }
        }
        None
    }

    /// Lets the quiet time after a failed exchange pass.
    ///
    /// # Panics
    /// If it does not end.
    pub fn settle(&mut self) {
        while !self.master.is_idle() {
            let at = self.master.poll_at().expect("a busy master has a deadline");
            assert!(self.run_until(at + Duration::from_micros(1)).is_none(), "nothing was asked");
        }
    }
}

/// A sensor without faults of the line.
pub fn sensor(name: &str, node: Box<dyn Node>) -> Station {
    Station { name: name.to_owned(), node, faults: Faults::default() }
}
