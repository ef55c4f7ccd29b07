//! One command on a real bus: its port, what it may do, and how its outcome is told.

use std::fmt::Display;
use std::io::{self, IsTerminal as _};

use clap::Args;
use clino_bus::line::EchoMode;
use clino_bus::{Duration, Protocol, Serial};
use clino_commissioning::{Commissionable, Operation, TaskProgress};
use clino_gateway::task::TaskEvent;

use crate::bus::{self, Asked, Broken, Bus, Make, Observer, Stop, TimingAt};
use crate::choice::choose;
use crate::number::within;
use crate::outcome::{DecodeVerdict, Failure};
use crate::port::{self, PortName, Wiring};
use crate::say::Say;

/// Longest allowance that makes sense: a T7 forgets half a command after 500 ms, an ISU after 400 ms.
const MAX_LATENCY_MS: u64 = 2_000;

/// The port, and how it behaves.
#[derive(Args, Clone, Debug)]
pub struct PortOptions {
    /// Serial port (/dev/ttyUSB0, COM3), pseudo-terminal, or tcp://host:port; `clino ports` lists them
    #[arg(long, value_name = "PORT")]
    pub port: PortName,
    /// How late the port may deliver, in ms, instead of what is known of it
    #[arg(long, value_name = "MS", value_parser = latency)]
    pub latency: Option<u64>,
    /// Whether the adapter returns what it sends: off, expected, or detect
    #[arg(long, value_name = "MODE", value_parser = echo, default_value = "detect")]
    pub echo: EchoMode,
    /// RTS switches the driver of the transceiver
    #[arg(long, conflicts_with = "rs485")]
    pub rts_de: bool,
    /// The kernel's RS485 mode switches the driver
    #[arg(long)]
    pub rs485: bool,
    /// One JSON object per line
    #[arg(long)]
    pub json: bool,
}

/// Leave for a command that writes to a sensor's memory.
#[derive(Args, Clone, Copy, Debug)]
pub struct Consent {
    /// Do not ask
    #[arg(long, short)]
    pub yes: bool,
}

/// A command at work on a bus.
pub struct Session<P: Protocol> {
    bus: Bus<P>,
    stop: Stop,
    /// Where its results go.
    pub say: Say,
    make: Make,
}

impl PortOptions {
    /// Where results go.
    pub fn say(&self) -> Say {
        Say::new(self.json)
    }

    /// What switches the driver.
    pub fn wiring(&self) -> Wiring {
        Wiring { rts_de: self.rts_de, rs485: self.rs485 }
    }

    /// Opens the port. What is wrong with it is told.
    ///
    /// # Errors
    /// [`Failure::Reported`].
    pub fn open<P>(&self, make: Make, serial: Serial, timing_at: TimingAt) -> Result<Session<P>, Failure>
    where
        P: Protocol + Commissionable,
    {
        let mut say = self.say();
        let stop = Stop::on_signals()?;
        let port = match port::open(&self.port, serial.baud, self.wiring()) {
            Ok(port) => port,
            Err(error) => return Err(port_failed(&mut say, &error)?),
        };
        let latency = self.latency.map_or_else(|| port.latency(), std::time::Duration::from_millis);
        let bus = Bus::new(port, serial, timing_at, latency, self.echo);
        Ok(Session { bus, stop, say, make })
    }

    /// The words that lead to this port again, for a command that is printed.
    pub fn words(&self) -> String {
        format!("--port {}", self.port)
    }
}

impl Consent {
    /// Refuses a program that did not say that it means what it asks for.
    ///
    /// # Errors
    /// [`Failure::Reported`].
    pub fn refuse_programs(self, say: &mut Say) -> Result<(), Failure> {
        let is_person = !say.is_for_programs() && io::stdin().is_terminal() && io::stderr().is_terminal();
        if self.yes || is_person {
            return Ok(());
        }
        let why = "not to be undone, wants --yes";
        if say.is_for_programs() {
            // As the console says it.
            say.print(&format!("{{\"error\":{{\"kind\":\"unconfirmed\",\"why\":\"{why}\"}}}}\n"))?;
        } else {
            say.error(why, "repeat the command with --yes if that is meant")?;
        }
        Err(Failure::UNCONFIRMED)
    }
}

impl<P: Protocol + Commissionable> Session<P> {
    /// Asks a person who has not said yes with the command.
    ///
    /// # Errors
    /// [`Failure::Reported`]: the answer is no.
    pub fn confirm(&mut self, consent: Consent, question: &str) -> Result<(), Failure> {
        if consent.yes || self.say.ask(question, &self.stop)? {
            return Ok(());
        }
        self.say.note("nothing was written")?;
        Err(Failure::STOPPED)
    }

    /// Runs an operation. A port that fails is told.
    ///
    /// # Errors
    /// [`Failure::Reported`], or the output failed.
    pub fn run<O>(&mut self, operation: O) -> Result<Result<O::Report, O::Error>, Failure>
    where
        O: Operation<Protocol = P>,
        O::Event: Into<TaskEvent>,
    {
        match self.bus.run(operation, &self.stop, &mut self.say) {
            Ok(result) => Ok(result),
            Err(Broken::Output(error)) => Err(error.into()),
            Err(Broken::Port(error)) => Err(port_failed(&mut self.say, &error)?),
        }
    }

    /// Runs an operation whose events are no news of the gateway; they are returned with its result.
    ///
    /// # Errors
    /// As [`Session::run`].
    pub fn collect<O>(&mut self, operation: O) -> Result<Collected<O>, Failure>
    where
        O: Operation<Protocol = P>,
    {
        let mut collector = Collector { say: &mut self.say, found: Vec::new() };
        let ran = self.bus.run(operation, &self.stop, &mut collector);
        let found = collector.found;
        match ran {
            Ok(result) => Ok(Collected { found, result }),
            Err(Broken::Output(error)) => Err(error.into()),
            Err(Broken::Port(error)) => Err(port_failed(&mut self.say, &error)?),
        }
    }

    /// Waits as long as a sensor may be deaf that has heard something else than commands: bytes at another bit rate, or the
    /// first half of one. `false` if that is no reason for its silence, because something was understood before.
    ///
    /// # Errors
    /// [`Failure::Reported`].
    pub fn rest(&mut self, span: Duration) -> Result<bool, Failure> {
        if self.bus.counters().good > 0 || self.stop.is_asked() {
            return Ok(false);
        }
        match self.bus.rest(span, &self.stop) {
            Ok(()) => Ok(!self.stop.is_asked()),
            Err(error) => Err(port_failed(&mut self.say, &error)?),
        }
    }

    /// Tells why nothing good came back.
    ///
    /// # Errors
    /// The output failed.
    pub fn diagnose(&mut self, asked: Asked) -> io::Result<()> {
        let diagnosis = bus::diagnose(self.make, asked, &self.bus.seen(), self.bus.counters());
        self.say.diagnosis(&diagnosis)
    }

    /// Tells why something answers that is never understood.
    ///
    /// # Errors
    /// The output failed.
    pub fn suspect(&mut self) -> io::Result<()> {
        self.say.diagnosis(&bus::collision(self.make))
    }

    /// Tells a person what a cause is, and what to do next. A program has its name.
    ///
    /// # Errors
    /// The output failed.
    pub fn explain(&mut self, cause: &dyn Display, next: Option<&str>) -> io::Result<()> {
        if self.say.is_for_programs() {
            return Ok(());
        }
        self.say.note(&cause.to_string())?;
        next.map_or(Ok(()), |next| self.say.note(next))
    }

    /// Whether another bit rate can be set.
    ///
    /// # Errors
    /// [`Failure::Reported`].
    pub fn can_change_baud(&mut self) -> Result<(), Failure> {
        match self.bus.can_change_baud() {
            Ok(()) => Ok(()),
            Err(error) => Err(port_failed(&mut self.say, &error)?),
        }
    }
}

/// What an operation has found, and how it ended.
pub struct Collected<O: Operation> {
    pub found: Vec<O::Event>,
    pub result: Result<O::Report, O::Error>,
}

/// Keeps what is found; progress is shown.
pub struct Collector<'a, E> {
    say: &'a mut Say,
    found: Vec<E>,
}

impl<'a, E> Collector<'a, E> {
    /// Nothing yet.
    pub fn new(say: &'a mut Say) -> Self {
        Self { say, found: Vec::new() }
    }

    /// All that was found.
    pub fn into_found(self) -> Vec<E> {
        self.found
    }
}

impl<E> Observer<E> for Collector<'_, E> {
    fn event(&mut self, event: E) -> io::Result<()> {
        self.found.push(event);
        Ok(())
    }

    fn progress(&mut self, progress: TaskProgress) {
        self.say.show_progress(progress);
    }

    fn stopping(&mut self) {
        self.say.tell_stopping();
    }
}

/// Tells what is wrong with a port.
///
/// # Errors
/// The output failed.
pub fn port_failed(say: &mut Say, error: &port::PortError) -> io::Result<Failure> {
    say.failed_object(error.object(), &error.message(), &error.next())?;
    Ok(Failure::PORT)
}

/// Done, or the sensor did not do it.
pub fn verdict(is_done: bool) -> DecodeVerdict {
    if is_done { DecodeVerdict::Good } else { DecodeVerdict::Bad }
}

fn latency(text: &str) -> Result<u64, String> {
    within(text, 0..=MAX_LATENCY_MS)
}

fn echo(text: &str) -> Result<EchoMode, String> {
    let name = |mode| match mode {
        EchoMode::Off => "off",
        EchoMode::Expected => "expected",
        EchoMode::Detect => "detect",
    };
    choose(text, [EchoMode::Off, EchoMode::Expected, EchoMode::Detect], name)
}
