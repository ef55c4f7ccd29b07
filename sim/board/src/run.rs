//! A run: an image on a board with a scenario around it, from power-up until the scenario ends.

use std::sync::{Arc, MutexGuard, PoisonError};
use std::{fmt, io};

use clino_sim::node::Ns;

use crate::analysis::{Analysis, Protocol};
use crate::checker::Checker;
use crate::console::{Console, Line, SharedTerminal};
use crate::edges::Edges;
use crate::elf::Image;
use crate::impairment::SharedImpairments;
use crate::incident::{self, Incident};
use crate::modbus::{Framing, ModbusLine, Parity, SharedMaster};
use crate::reception::Reception;
use crate::scenario::{Bench, Planned, Scenario};
use crate::summary::Summary;
use crate::vcd::{self, Signal};
use crate::{Board, BuildError, HostPorts, Ports, SerialPort, Stopped};
use clino_segment::Segment;
use clino_segment::log::{LineEvent, SegmentLog, SharedLog};
use clino_segment::trace::Trace;
use clino_segment::wire::Wire;

/// How often the console is looked at, and the run may be stopped, in virtual time.
const LOOK: Ns = 10_000_000;

/// What a run does beside what its scenario says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Extras {
    /// Records the levels of the lines, for [`Run::write_vcd`].
    pub levels: bool,
    /// In place of the T7s and the ISUs of the scenario there is a computer with an adapter on the bus.
    pub adapters: [bool; 2],
}

/// One of the two RS485 buses.
struct Bus {
    name: &'static str,
    protocol: Protocol,
    log: SharedLog,
    /// The log begins here.
    since: Ns,
    /// The computer on the bus, if there is one in place of sensors.
    adapter: Option<SharedMaster>,
}

/// A board with a scenario on its pins.
pub struct Run {
    board: Board,
    terminal: SharedTerminal,
    modbus: SharedMaster,
    modbus_log: SharedLog,
    impairments: HostPorts<SharedImpairments>,
    buses: [Bus; 2],
    /// A user is at the console or at the Modbus port.
    attended: bool,
    checker: Checker,
    duration: Ns,
    /// Names and levels of the lines, if they are recorded.
    traces: Vec<(&'static str, Trace)>,
    /// How much of what happened on the lines is kept, and up to when it has been forgotten.
    remembered: Ns,
    forgotten: Ns,
    now: Ns,
    stopped: Option<Stopped>,
}

impl Run {
    /// Puts everything together, power on at time 0.
    ///
    /// # Errors
    /// The emulator refuses the board, or a fault cannot be planted into this image.
    pub fn new(image: &Image, scenario: &Scenario) -> Result<Self, BuildError> {
        Self::with(image, scenario, Extras::default())
    }

    /// The same with these extras.
    ///
    /// # Errors
    /// As [`Run::new`].
    pub fn with(image: &Image, scenario: &Scenario, extras: Extras) -> Result<Self, BuildError> {
        let Bench { t7, isu, pwm, truths } = scenario.build();
        let mut console = Console::new();
        let mut traces = Vec::new();
        let terminal = console.terminal();
        for Planned { at, what: line, gaps } in scenario.typed() {
            terminal.lock().type_with_gaps(at, format!("{line}\r").as_bytes(), &gaps);
        }
        let mut trace = |name, of: &mut dyn FnMut() -> Trace| {
            if extras.levels {
                traces.push((name, of()));
            }
        };
        let [t7_adapter, isu_adapter] = extras.adapters;
        let (t7, t7_bus) = sensors("t7", Protocol::T7, t7, t7_adapter.then_some(T7_LINE), &mut trace);
        let (isu, isu_bus) = sensors("isu", Protocol::Isu, isu, isu_adapter.then_some(ISU_LINE), &mut trace);
        let buses = [t7_bus, isu_bus];
        let mut line = ModbusLine::new("master", scenario.modbus());
        trace("modbus", &mut || line.trace());
        trace("console", &mut || console.trace());
        let (modbus, modbus_log) = (line.master(), line.log());
        for Planned { at, what: bytes, gaps } in scenario.requests() {
            modbus.lock().send_with_gaps(at, bytes, &gaps);
        }
        let lines = scenario.impair(HostPorts { console: Box::new(console), modbus: Box::new(line) });
        let impairments =
            HostPorts { console: lines.console.impairments(), modbus: lines.modbus.impairments() };
        let ports = Ports { t7, isu, console: Box::new(lines.console), modbus: Box::new(lines.modbus), pwm };
        let mut board = Board::clocked_by(scenario.oscillators(), image, ports)?;
        for injection in scenario.injections() {
            board.inject(injection, image)?;
        }
        Ok(Self {
            board,
            terminal,
            modbus,
            modbus_log,
            impairments,
            buses,
            attended: false,
            checker: Checker::new(truths),
            duration: scenario.duration(),
            traces,
            remembered: Ns::MAX,
            forgotten: 0,
            now: 0,
            stopped: None,
        })
    }

    /// Runs another duration than the scenario's.
    pub fn set_duration(&mut self, duration: Ns) {
        self.duration = duration;
    }

    /// A user is at the console or at the Modbus port. What is no JSON on the console is for people then, and the
    /// readings do not fail the run: the user may have switched them off, or set a zero.
    pub fn attend(&mut self) {
        self.attended = true;
    }

    /// Runs on by a few milliseconds, and hands over the console lines that came. Returns whether there is
    /// more to run.
    pub fn go_on(&mut self, line: impl FnMut(&Line)) -> bool {
        self.go_on_by(LOOK, line)
    }

    /// As [`Run::go_on`], by `step` rounded up to whole milliseconds.
    pub fn go_on_by(&mut self, step: Ns, mut line: impl FnMut(&Line)) -> bool {
        if self.stopped.is_some() || self.now >= self.duration {
            return false;
        }
        self.now = self.now.saturating_add(step).min(self.duration);
        self.stopped = self.board.run_until(self.now).err();
        self.forget();
        loop {
            let taken = self.terminal.lock().take_line();
            let Some(taken) = taken else { break };
            if !self.attended || taken.text.starts_with('{') {
                self.checker.line(&taken);
            }
            line(&taken);
        }
        self.stopped.is_none() && self.now < self.duration
    }

    /// Runs to the end.
    pub fn finish(&mut self, mut line: impl FnMut(&Line)) {
        while self.go_on(&mut line) {}
    }

    /// The board, to look into or to type on.
    pub fn board(&mut self) -> &mut Board {
        &mut self.board
    }

    /// The console's far end.
    pub fn terminal(&self) -> SharedTerminal {
        self.terminal.clone()
    }

    /// The Modbus port's far end.
    pub fn modbus(&self) -> SharedMaster {
        self.modbus.clone()
    }

    /// The computers in place of the sensors of the T7 and the ISU bus, where there are any ([`Extras::adapters`]).
    pub fn adapters(&self) -> [Option<SharedMaster>; 2] {
        self.buses.each_ref().map(|bus| bus.adapter.clone())
    }

    /// What happened on the Modbus port's pair; the master is its only node.
    pub fn modbus_log(&self) -> SharedLog {
        Arc::clone(&self.modbus_log)
    }

    /// What is done to what comes in at the console and at the Modbus port.
    pub fn impairments(&self) -> &HostPorts<SharedImpairments> {
        &self.impairments
    }

    /// What has arrived at the console and at the Modbus port.
    pub fn receptions(&self) -> HostPorts<Vec<Reception>> {
        let of = |port| self.board.receptions(port);
        HostPorts { console: of(SerialPort::Console), modbus: of(SerialPort::Modbus) }
    }

    /// Virtual time that has been run.
    pub fn now(&self) -> Ns {
        self.now
    }

    /// Keeps only the last `span` of what happens on the lines, and up to a tenth more, so that a run may be long: the
    /// bus log and the figures of the buses begin with the last request before that.
    pub fn remember(&mut self, span: Ns) {
        self.remembered = span;
    }

    fn forget(&mut self) {
        let horizon = self.now.saturating_sub(self.remembered);
        if horizon < self.forgotten.saturating_add(self.remembered / 10) {
            return;
        }
        self.forgotten = horizon;
        for bus in &mut self.buses {
            bus.since = forget(&bus.log, horizon).unwrap_or(bus.since);
        }
        forget(&self.modbus_log, horizon);
        self.board.forget_receptions(horizon);
    }

    /// The readings so far.
    pub fn checker(&self) -> &Checker {
        &self.checker
    }

    /// Name and figures of each bus so far.
    pub fn analyses(&self) -> Vec<(&'static str, Analysis)> {
        let analysis = |bus: &Bus| {
            let log = lock(&bus.log);
            (bus.name, Analysis::of(&log, bus.protocol, bus.since..self.now))
        };
        self.buses.iter().map(analysis).collect()
    }

    /// Name of each PWM input with readings, and what they are like against its edges, so far.
    fn edges(&self) -> Vec<(String, Edges)> {
        let inputs = ["pwm1", "pwm2"].into_iter().enumerate().filter_map(|(input, bus)| {
            let slot = self.checker.slots().iter().find(|slot| slot.truth.who.bus == bus)?;
            let edges = Edges::of(&self.board.pwm_log(input), &slot.heard);
            (edges.readings > 0).then(|| (bus.to_owned(), edges))
        });
        inputs.collect()
    }

    /// The summary so far, and whether all is well.
    pub fn summary(&self) -> (String, bool) {
        let buses = self.analyses();
        let core = self.board.stats();
        let mut faults: Vec<String> = self.stopped.iter().map(Stopped::to_string).collect();
        let incidents = self.board.incidents();
        // A planted fault brings a reset, and so may a crystal that stops.
        let brings_reset = |event: incident::Event| {
            matches!(event, incident::Event::Planted { .. } | incident::Event::Crystal { swings: false })
        };
        let planted = incidents.iter().filter(|incident| brings_reset(incident.event)).count();
        if core.resets > planted as u64 {
            faults.push(format!(
                "the chip was reset {} times, with {planted} reasons in the scenario",
                core.resets
            ));
        }
        let unreadable = self.terminal.lock().unreadable();
        if unreadable > 0 {
            faults.push(format!("{unreadable} console characters have the wrong bit rate or format"));
        }
        if !self.attended {
            faults.extend(self.checker.faults(self.now));
        }
        for (name, bus) in &buses {
            faults.extend(bus.broken_rules().into_iter().map(|broken| format!("bus {name}: {broken}")));
        }
        let pwm = self.edges();
        let modbus = self.modbus.lock().traffic();
        let (end, checker) = (self.now, &self.checker);
        let (pwm, incidents) = (&pwm[..], &incidents[..]);
        let summary = Summary { end, checker, buses: &buses, pwm, modbus, core, incidents, faults: &faults };
        (summary.to_string(), faults.is_empty())
    }

    /// The incidents of the chip so far: resets, injected faults.
    pub fn incidents(&self) -> Vec<Incident> {
        self.board.incidents()
    }

    /// Writes the events of both buses and of the Modbus port and the incidents of the chip, in order.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write_bus_log(&self, out: &mut impl io::Write) -> io::Result<()> {
        let buses = self.buses.iter().map(|bus| (bus.name, &bus.log));
        let logs: Vec<_> =
            buses.chain([("modbus", &self.modbus_log)]).map(|(name, log)| (name, lock(log))).collect();
        let mut events: Vec<(&str, &SegmentLog, &LineEvent)> = Vec::new();
        for (name, log) in &logs {
            events.extend(log.in_order().into_iter().map(|event| (*name, &**log, event)));
        }
        events.sort_by_key(|(.., event)| event.at());
        let mut others = self.other_lines().into_iter().peekable();
        for (name, log, event) in events {
            while let Some((_, line)) = others.next_if(|(at, _)| *at <= event.at()) {
                writeln!(out, "{line}")?;
            }
            writeln!(out, "{}", log.text(name, event))?;
        }
        others.try_for_each(|(_, line)| writeln!(out, "{line}"))
    }

    /// Writes the levels of all lines since power-up as a value change dump: [`crate::vcd`].
    ///
    /// # Errors
    /// Those of `out`; the levels are not recorded ([`Extras::levels`]).
    pub fn write_vcd(&self, out: impl io::Write) -> io::Result<()> {
        if self.traces.is_empty() {
            return Err(io::Error::other("the levels of this run are not recorded"));
        }
        let driver = |log: &SharedLog| vcd::driver_enable(&lock(log));
        let mut signals: Vec<Signal> = Vec::new();
        for (name, trace) in &self.traces {
            let log = match *name {
                "modbus" => Some(&self.modbus_log),
                bus => self.buses.iter().find(|it| it.name == bus).map(|it| &it.log),
            };
            let line = if log.is_some() { "pair" } else { "tx" };
            signals.push(Signal { name: format!("{name}_{line}"), initial: true, changes: trace.changes() });
            signals.extend(log.map(|log| Signal {
                name: format!("{name}_de"),
                initial: false,
                changes: driver(log),
            }));
        }
        for bus in self.buses.iter().filter(|bus| bus.adapter.is_some()) {
            let changes = vcd::adapter(&lock(&bus.log));
            signals.push(Signal { name: format!("{}_adapter", bus.name), initial: false, changes });
        }
        for input in 0..2 {
            let changes = self.board.pwm_edges(input);
            signals.push(Signal { name: format!("pwm{}", input + 1), initial: false, changes });
        }
        let changes = vcd::reset_pin(&self.incidents());
        signals.push(Signal { name: "nrst".to_owned(), initial: true, changes });
        vcd::write(&signals, self.now, out)
    }

    /// Lines of the bus log that are not about a pair, each with its time, in order.
    fn other_lines(&self) -> Vec<(Ns, String)> {
        let incidents = self.incidents().into_iter().map(|incident| (incident.at, incident.to_string()));
        let mut lines: Vec<_> = incidents.collect();
        let (impairments, receptions) = (self.impairments(), self.receptions());
        for (port, impairments, receptions) in [
            (SerialPort::Console, &impairments.console, receptions.console),
            (SerialPort::Modbus, &impairments.modbus, receptions.modbus),
        ] {
            let line = |at, what, details: &dyn fmt::Display| {
                (at, format!("{at:>12} {} {what:<10} gateway {details}", port.name()))
            };
            lines.extend(impairments.lock().log().iter().map(|done| line(done.at, "impaired", done)));
            lines.extend(receptions.iter().map(|seen| line(seen.at, "received", seen)));
        }
        lines.sort_by_key(|(at, _)| *at);
        lines
    }
}

/// How a computer's adapter on the T7 bus is set, as its sensors are from the factory; and on the ISU bus.
const T7_LINE: Framing = Framing { baud: 115_200, parity: Parity::None, stop_bits: 1 };
const ISU_LINE: Framing = Framing { baud: 9_600, parity: Parity::None, stop_bits: 1 };

/// The wire of a bus of sensors: the scenario's, or a computer with an adapter that is set so.
fn sensors(
    name: &'static str,
    protocol: Protocol,
    mut sensors: Segment,
    adapter: Option<Framing>,
    trace: &mut dyn FnMut(&'static str, &mut dyn FnMut() -> Trace),
) -> (Box<dyn Wire>, Bus) {
    let Some(framing) = adapter else {
        trace(name, &mut || sensors.trace());
        let log = sensors.log();
        return (Box::new(sensors), Bus { name, protocol, log, since: 0, adapter: None });
    };
    let mut line = ModbusLine::new("adapter", framing);
    trace(name, &mut || line.trace());
    let (log, adapter) = (line.log(), Some(line.master()));
    (Box::new(line), Bus { name, protocol, log, since: 0, adapter })
}

fn lock(log: &SharedLog) -> MutexGuard<'_, SegmentLog> {
    log.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Drops what came before the last rise of the gateway's DE that is not after `horizon`; returns when that was.
fn forget(log: &SharedLog, horizon: Ns) -> Option<Ns> {
    let mut log = lock(log);
    let is_rise = |event: &LineEvent| matches!(*event, LineEvent::De { at, high: true } if at <= horizon);
    let first = log.events.iter().rposition(is_rise)?;
    log.events.drain(..first);
    log.events.first().map(LineEvent::at)
}
