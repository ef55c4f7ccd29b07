//! A run: an image on a board with a scenario around it, from power-up until the scenario ends.

use std::io;
use std::sync::PoisonError;

use clino_sim::node::Ns;

use crate::analysis::{Analysis, Protocol};
use crate::console::{Console, Line, SharedTerminal};
use crate::edges::Edges;
use crate::elf::Image;
use crate::oracle::Oracle;
use crate::scenario::{Bench, Scenario};
use crate::summary::Summary;
use crate::{Board, BuildError, Ports, Stopped};
use clino_segment::log::{Event, SharedLog};

/// How often the console is looked at, and the run may be stopped, in virtual time.
const LOOK: Ns = 10_000_000;

/// One of the two RS485 buses.
struct Bus {
    name: &'static str,
    protocol: Protocol,
    log: SharedLog,
}

/// A board with a scenario on its pins.
pub struct Run {
    board: Board,
    terminal: SharedTerminal,
    buses: [Bus; 2],
    oracle: Oracle,
    duration: Ns,
    now: Ns,
    stopped: Option<Stopped>,
}

impl Run {
    /// Puts everything together, power on at time 0.
    ///
    /// # Errors
    /// The emulator refuses the board.
    pub fn new(image: &Image, scenario: &Scenario) -> Result<Self, BuildError> {
        let Bench { t7, isu, pwm, truths } = scenario.build();
        let console = Console::new();
        let terminal = console.terminal();
        for (at, line) in scenario.typed() {
            terminal.lock().type_bytes(at, format!("{line}\r").as_bytes());
        }
        let buses = [
            Bus { name: "t7", protocol: Protocol::T7, log: t7.log() },
            Bus { name: "isu", protocol: Protocol::Isu, log: isu.log() },
        ];
        let ports = Ports {
            t7: Box::new(t7),
            isu: Box::new(isu),
            console: Box::new(console),
            modbus: Box::new(Console::new()),
            pwm,
        };
        Ok(Self {
            board: Board::new(image, ports)?,
            terminal,
            buses,
            oracle: Oracle::new(truths),
            duration: scenario.duration(),
            now: 0,
            stopped: None,
        })
    }

    /// Runs another duration than the scenario's.
    pub fn set_duration(&mut self, duration: Ns) {
        self.duration = duration;
    }

    /// Runs on by a few milliseconds, and hands over the console lines that came. Returns whether there is
    /// more to run.
    pub fn go_on(&mut self, mut line: impl FnMut(&Line)) -> bool {
        if self.stopped.is_some() || self.now >= self.duration {
            return false;
        }
        self.now = (self.now + LOOK).min(self.duration);
        self.stopped = self.board.run_until(self.now).err();
        loop {
            let taken = self.terminal.lock().take_line();
            let Some(taken) = taken else { break };
            self.oracle.line(&taken);
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

    /// The readings so far.
    pub fn oracle(&self) -> &Oracle {
        &self.oracle
    }

    /// Name and figures of each bus so far.
    pub fn analyses(&self) -> Vec<(&'static str, Analysis)> {
        let analysis = |bus: &Bus| {
            let log = bus.log.lock().unwrap_or_else(PoisonError::into_inner);
            (bus.name, Analysis::of(&log, bus.protocol, self.now))
        };
        self.buses.iter().map(analysis).collect()
    }

    /// Name of each PWM input with readings, and what they are like against its edges, so far.
    fn edges(&self) -> Vec<(String, Edges)> {
        let inputs = ["pwm1", "pwm2"].into_iter().enumerate().filter_map(|(input, bus)| {
            let slot = self.oracle.slots().iter().find(|slot| slot.truth.who.bus == bus)?;
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
        if core.resets > 0 {
            faults.push(format!("the chip was reset {} times", core.resets));
        }
        let unreadable = self.terminal.lock().unreadable();
        if unreadable > 0 {
            faults.push(format!("{unreadable} console characters have the wrong bit rate or format"));
        }
        faults.extend(self.oracle.faults(self.now));
        for (name, bus) in &buses {
            faults.extend(bus.broken_rules().into_iter().map(|broken| format!("bus {name}: {broken}")));
        }
        let pwm = self.edges();
        let summary =
            Summary { end: self.now, oracle: &self.oracle, buses: &buses, pwm: &pwm, core, faults: &faults };
        (summary.to_string(), faults.is_empty())
    }

    /// Writes what happened on both buses, in order.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write_bus_log(&self, out: &mut impl io::Write) -> io::Result<()> {
        let logs = self.buses.each_ref().map(|bus| bus.log.lock().unwrap_or_else(PoisonError::into_inner));
        let mut events: Vec<(usize, &Event)> = Vec::new();
        for (n, log) in logs.iter().enumerate() {
            events.extend(log.in_order().into_iter().map(|event| (n, event)));
        }
        events.sort_by_key(|(_, event)| event.at());
        for (n, event) in events {
            writeln!(out, "{}", logs[n].text(self.buses[n].name, event))?;
        }
        Ok(())
    }
}
