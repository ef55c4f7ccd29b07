//! The portable bus crates over a port: this file moves bytes and time, and decides nothing about sensors.
//!
//! ```text
//!  Operation ── Runner ── Master ── Line ── Bus ── Port ── adapter ── pair
//!  (commissioning)        (bus crate)       (here)
//! ```
//! # Times that a PC does not see
//!
//! [`Line`] is made for a UART whose interrupts tell when a character ends. A port tells less:
//!
//! | | here |
//! |---|---|
//! | when a frame is out | its own time after the port took it; earlier if something else than its echo is heard: a sensor then answers |
//! | when a character was on the pair | up to the port's latency before it is read: that much is added to each wait (`bus/timing.rs`) |
//! | which characters are our echo | as many as were sent, the first that are read after (`bus/echo.rs`) |
//!
//! # A busy computer
//!
//! This program may stand still at any instant, for any time. So the port is read again after the clock, before a deadline is
//! judged: an answer that has come in time is found, however late this program is.

mod ask;
mod clock;
mod diagnosis;
mod echo;
mod stop;
mod timing;

use std::io;

use clino_bus::line::{EchoMode, LineSettings, SubmitError};
use clino_bus::{
    BusCounters, Duration, Event, ExchangeOutcome, Fault, Instant, Line, Master, Protocol, Serial, Timing,
};
use clino_codec::character::Character;
use clino_commissioning::{Commissionable, Operation, Runner, RunnerAction, TaskProgress};

use crate::port::{Port, PortError};
pub use ask::AskT7;
pub use clock::Clock;
pub use diagnosis::{Asked, Diagnosis, Make, Seen, collision, diagnose, overheard};
pub use echo::{Echo, Whose};
pub use stop::Stop;

/// The longest wait without a look at whether the user wants to stop. A signal ends a wait at once on most systems.
const LOOK: Duration = Duration::from_millis(50);

/// Waits of a protocol at a bit rate.
pub type TimingAt = fn(Serial) -> Timing;

/// What is told while an operation runs.
pub trait Observer<E> {
    /// The operation has found something.
    ///
    /// # Errors
    /// It cannot be told.
    fn event(&mut self, event: E) -> io::Result<()>;

    /// How far the operation is.
    fn progress(&mut self, progress: TaskProgress);

    /// The user wants to stop: the operation goes on to its next safe point.
    fn stopping(&mut self);
}

/// Why an operation did not come to its end.
#[derive(Debug)]
pub enum Broken {
    /// The port failed.
    Port(PortError),
    /// What was found cannot be told.
    Output(io::Error),
}

impl From<PortError> for Broken {
    fn from(error: PortError) -> Self {
        Self::Port(error)
    }
}

/// One pair of wires behind a port, and its master.
pub struct Bus<P: Protocol> {
    port: Box<dyn Port>,
    line: Line,
    master: Master<P>,
    clock: Clock,
    timing_at: TimingAt,
    /// How much later than on the pair a character is read.
    latency: Duration,
    /// The frame on its way, until its last stop bit.
    draining: Option<Instant>,
    /// When the last frame was out.
    released: Instant,
    echo: Echo,
    heard: Vec<Character>,
    /// Characters heard, and those that came back although they should not.
    seen: Seen,
}

impl<P: Protocol + Commissionable> Bus<P> {
    /// A master on an open port.
    pub fn new(
        port: Box<dyn Port>,
        serial: Serial,
        timing_at: TimingAt,
        latency: std::time::Duration,
        echo: EchoMode,
    ) -> Self {
        let (clock, latency) = (Clock::start(), timing::of_system(latency));
        let timing = timing::widened(timing_at(serial), latency);
        let line = Line::new(LineSettings { echo, ..timing.line() }, clock.now());
        Self {
            port,
            line,
            master: Master::new(timing),
            clock,
            timing_at,
            latency,
            draining: None,
            released: Instant::ZERO,
            echo: Echo::default(),
            heard: Vec::new(),
            seen: Seen::new(echo),
        }
    }

    /// What the master has counted.
    pub fn counters(&self) -> &BusCounters {
        self.master.counters()
    }

    /// What was heard.
    pub fn seen(&self) -> Seen {
        let mut seen = self.seen;
        (seen.has_echo, seen.latency) = (self.line.has_echo(), self.latency);
        seen
    }

    /// The bit rate in force.
    pub fn serial(&self) -> Serial {
        self.line.settings().serial
    }

    /// Whether the pair can be given another rate.
    ///
    /// # Errors
    /// It is set elsewhere.
    pub fn can_change_baud(&self) -> Result<(), PortError> {
        self.port.can_change_baud()
    }

    /// Runs an operation to its end.
    ///
    /// # Errors
    /// The port, or the output, failed in the middle. What an operation itself says of its failure is its result.
    pub fn run<O>(
        &mut self,
        operation: O,
        stop: &Stop,
        observer: &mut dyn Observer<O::Event>,
    ) -> Result<Result<O::Report, O::Error>, Broken>
    where
        O: Operation<Protocol = P>,
    {
        let mut runner = Runner::new(operation);
        let mut cancelled = false;
        let mut outcomes = Vec::new();
        loop {
            if !cancelled && stop.is_asked() {
                cancelled = true;
                observer.stopping();
                runner.cancel();
            }
            let now = self.clock.now();
            match runner.poll(&mut self.master, now) {
                RunnerAction::Send(frame) => {
                    let give_up = now + self.master.timing().line_busy;
                    if let Err(SubmitError::Busy | SubmitError::Length(_)) =
                        self.line.submit(frame.as_ref(), give_up)
                    {
                        outcomes.push(ExchangeOutcome { result: Err(Fault::NotSent), at: now });
                    }
                }
                RunnerAction::Serial(serial) => {
                    self.set_serial(serial)?;
                    continue;
                }
                RunnerAction::Done(result) => return Ok(result),
                RunnerAction::Idle => {}
            }
            if outcomes.is_empty() {
                let runner_at = runner.poll_at().filter(|_| !self.master.is_asking());
                self.step(runner_at, &mut outcomes)?;
            }
            for outcome in outcomes.drain(..) {
                if let Some(event) = runner.settle(&outcome) {
                    observer.event(event).map_err(Broken::Output)?;
                }
            }
            observer.progress(runner.progress());
        }
    }

    /// Sends nothing for that long, or until the user wants to stop. What is heard belongs to nothing.
    ///
    /// # Errors
    /// The port failed.
    pub fn rest(&mut self, span: Duration, stop: &Stop) -> Result<(), PortError> {
        let until = self.clock.now() + span;
        let mut outcomes = Vec::new();
        while self.clock.now() < until && !stop.is_asked() {
            self.step(Some(until), &mut outcomes)?;
        }
        Ok(())
    }

    /// The pair runs at another rate from now on.
    fn set_serial(&mut self, serial: Serial) -> Result<(), PortError> {
        let timing = timing::widened((self.timing_at)(serial), self.latency);
        let settings = LineSettings { serial, guard: timing.guard, ..*self.line.settings() };
        // An operation changes the rate between two exchanges; at worst the end of a frame is still awaited.
        let mut outcomes = Vec::new();
        while self.line.set(settings, self.clock.now()).is_err() {
            self.step(None, &mut outcomes)?;
        }
        self.master.set_timing(timing);
        self.echo = Echo::default();
        self.heard.clear();
        self.port.set_baud(serial.baud)
    }

    /// Waits until something is to be done, at most until `until`; does it.
    fn step(
        &mut self,
        until: Option<Instant>,
        outcomes: &mut Vec<ExchangeOutcome<P>>,
    ) -> Result<(), PortError> {
        let now = self.clock.now();
        let at = [until, self.master.poll_at(), self.line_at(), self.draining].into_iter().flatten().min();
        let at = at.unwrap_or(now + LOOK).min(now + LOOK);
        self.port.receive(timing::to_system(at.since(now)), &mut self.heard)?;
        // What comes from here on is later than `now`; what came before is in `heard`.
        let now = self.clock.now();
        self.port.receive(std::time::Duration::ZERO, &mut self.heard)?;
        for character in std::mem::take(&mut self.heard) {
            self.hear(character, now, outcomes)?;
        }
        if self.draining.is_some_and(|at| at <= now) {
            self.release(now, outcomes)?;
        }
        self.poll_line(now, outcomes)?;
        // A frame that went out late because this program stood still is on its way all the same.
        let is_due = self.draining.is_none() && self.master.poll_at().is_some_and(|at| at <= now);
        if is_due {
            // Held back as what may be an echo, and it is not.
            for held in self.echo.give_up() {
                self.foreign(held, now, outcomes)?;
            }
            while let Some(outcome) = self.master.poll(now) {
                outcomes.push(outcome);
            }
        }
        Ok(())
    }

    /// When the line has something to do; an echo that is still on its way through the adapter is not lost.
    fn line_at(&self) -> Option<Instant> {
        match self.echo.until() {
            Some(until) => self.line.poll_at().map(|at| at.max(until)),
            None if self.draining.is_some() => None,
            None => self.line.poll_at(),
        }
    }

    fn poll_line(&mut self, now: Instant, outcomes: &mut Vec<ExchangeOutcome<P>>) -> Result<(), PortError> {
        if self.draining.is_some() || self.echo.until().is_some_and(|until| now < until) {
            return Ok(());
        }
        while let Some(step) = self.line.poll(now) {
            if let Some(event) = step.event(now) {
                outcomes.extend(self.master.on(event));
            } else {
                self.send(outcomes)?;
            }
        }
        Ok(())
    }

    /// The guard is over: the frame goes out.
    fn send(&mut self, outcomes: &mut Vec<ExchangeOutcome<P>>) -> Result<(), PortError> {
        let mut frame = Vec::new();
        while let Some(byte) = self.line.next_character() {
            frame.push(byte);
        }
        self.port.send(&frame)?;
        // Not before the port has it, however long that took.
        let began = self.clock.now();
        let serial = self.serial();
        let out = began + serial.characters(frame.len() as u32);
        self.draining = Some(out);
        let late = out + self.latency + serial.characters(1);
        self.seen.sent(&frame);
        self.echo = Echo::begin(frame, self.line.has_echo(), began, late);
        // With no time to pass, as at a port without a pair.
        if out <= began {
            self.release(began, outcomes)?;
        }
        Ok(())
    }

    /// The frame is out.
    fn release(&mut self, now: Instant, outcomes: &mut Vec<ExchangeOutcome<P>>) -> Result<(), PortError> {
        let Some(out) = self.draining.take() else { return Ok(()) };
        self.port.sent()?;
        let at = out.min(now);
        self.released = at;
        if self.line.transmission_complete(at) {
            outcomes.extend(self.master.on(Event::Released { at }));
        }
        Ok(())
    }

    /// A character has been read.
    fn hear(
        &mut self,
        character: Character,
        now: Instant,
        outcomes: &mut Vec<ExchangeOutcome<P>>,
    ) -> Result<(), PortError> {
        self.seen.heard(character);
        match self.echo.judge(character) {
            Whose::Held => {}
            Whose::Ours(characters, began) => {
                for character in characters {
                    let event = self.line.heard(character, began);
                    outcomes.extend(self.master.on(event));
                }
                if self.echo.is_over() {
                    // All of it is back: it is out.
                    self.release(now, outcomes)?;
                }
            }
            Whose::Others(characters) => {
                for character in characters {
                    self.foreign(character, now, outcomes)?;
                }
            }
        }
        Ok(())
    }

    /// A character that is no echo. If a frame is on its way, it is out: a sensor answers.
    fn foreign(
        &mut self,
        character: Character,
        now: Instant,
        outcomes: &mut Vec<ExchangeOutcome<P>>,
    ) -> Result<(), PortError> {
        self.release(now, outcomes)?;
        // Later than the line takes anything for an echo: half a character after the frame. Not later than that: the guard before
        // the next frame begins here.
        let at = now.max(self.released + self.serial().characters(1));
        let event = self.line.heard(character, at);
        outcomes.extend(self.master.on(event));
        Ok(())
    }
}

#[cfg(test)]
mod tests;
