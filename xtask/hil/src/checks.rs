//! The checks, in the order in which a person would make them.

mod bus;
mod faults;
mod pwm;
mod start;
mod stored;
mod uplink;
mod wires;

use std::io::{BufRead as _, stdin};

use serde_json::Value;

use crate::arguments::Arguments;
use crate::board::Board;
use crate::console::Console;
use crate::ports::Ports;
use crate::report::Report;
use crate::sensors::Sensors;

use bus::{ISU, T7};

/// What the checks work with.
struct Bench<'a> {
    arguments: &'a Arguments,
    report: &'a mut Report,
    console: Console,
}

/// Makes them all.
///
/// # Errors
/// What keeps the rest from being made: the console does not answer, a program is missing.
pub fn all(arguments: &Arguments, report: &mut Report) -> Result<(), String> {
    let (ports, virtual_board) = Board::ports(arguments)?;
    // Opened first: what the image says at its start is not to be missed.
    let console = Console::open(&ports.console)?;
    let console = if arguments.on_qemu { console.typed() } else { console };
    let board = match virtual_board {
        Some(board) => board,
        None if arguments.no_flash => Board::Real(None),
        None => Board::flash(&arguments.elf, &arguments.chip)?,
    };
    let mut bench = Bench { arguments, report, console };
    if let Err(why) = bench.with(&board, &ports) {
        return Err(format!("{why}{}", board.last_words()));
    }
    match board.end()? {
        Some(capture) => wires::of_virtual_board(&mut bench, &capture),
        None if arguments.on_qemu => {
            bench.report.skip("times on the wires", "QEMU has none");
            faults::check(bench.arguments, bench.report);
        }
        None if arguments.analyser.is_none() => {
            let why = "no logic analyser (--analyser DRIVER); docs/bring-up.md has pictures for a scope";
            bench.report.skip("times on the wires", why);
        }
        None => {}
    }
    Ok(())
}

impl Bench<'_> {
    /// All checks that need the running board.
    fn with(&mut self, board: &Board, ports: &Ports) -> Result<(), String> {
        start::check(self, board)?;
        pwm::check(self)?;
        let t7 = self.sensors(&T7, ports.t7.as_deref())?;
        let isu = self.sensors(&ISU, ports.isu.as_deref())?;
        self.uplink(ports, t7.is_some() && isu.is_some())?;
        if self.arguments.on_qemu {
            self.report.skip("save", "QEMU's flash cannot be programmed");
        } else if !self.arguments.short {
            stored::check(self)?;
        }
        if let Some(driver) = &self.arguments.analyser {
            wires::captured(self, driver);
        }
        if self.arguments.on_qemu { Ok(()) } else { stored::leave_as_delivered(self) }
    }

    /// Checks a bus with simulated sensors behind the adapter at this port, or behind the one that is moved there.
    fn sensors(&mut self, bus: &bus::Bus, port: Option<&str>) -> Result<Option<Sensors>, String> {
        if let Some(port) = port {
            return bus.check(self, port);
        }
        if let Some(adapter) = self.arguments.adapter.as_deref() {
            ask_to_move(&format!("the pair of the {} bus", bus.title))?;
            // The adapter is needed elsewhere then.
            bus.check(self, adapter).map(drop)?;
            return Ok(None);
        }
        self.report.skip(format!("{} bus", bus.title), "no adapter on it");
        Ok(None)
    }

    fn uplink(&mut self, ports: &Ports, sensors: bool) -> Result<(), String> {
        let Bench { arguments, .. } = *self;
        match (&ports.modbus, &arguments.adapter) {
            (Some(port), _) => uplink::check(self, port, sensors),
            (None, Some(adapter)) => {
                ask_to_move("the pair of the Modbus port")?;
                uplink::check(self, adapter, false)
            }
            (None, None) => {
                self.report.skip("Modbus port", "no adapter on it");
                Ok(())
            }
        }
    }

    /// The object of a slot in `list`.
    fn slot(&mut self, slot: u64) -> Result<Value, String> {
        let list = self.console.ask("list")?;
        let found = list.into_iter().find(|object| object["slot"] == slot);
        found.ok_or_else(|| format!("slot {slot} is not in `list`"))
    }
}

/// Status and angle of a slot, as the table has it.
fn shown(object: &Value) -> String {
    let angle = object["angle_deg"].as_f64().map_or("-".to_owned(), |angle| format!("{angle:.3}"));
    format!("{} {angle}", object["status"].as_str().unwrap_or("?"))
}

/// Waits until a person has done it.
fn ask_to_move(place: &str) -> Result<(), String> {
    eprintln!("connect the adapter to {place}, then press Enter");
    let mut line = String::new();
    match stdin().lock().read_line(&mut line) {
        Ok(0) => Err("no person is there to move the adapter".to_owned()),
        Ok(_) => Ok(()),
        Err(why) => Err(why.to_string()),
    }
}
