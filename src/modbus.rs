//! The Modbus level: a software interrupt in which the Modbus server runs.
//!
//! The port and the clock's second alarm raise it. Each run hands the server what has come in, sends the answer that it
//! has made, and sets the alarm for the next deadline.

use core::cell::Cell;

use clino_bus::{DriverEnable, Micros};
use clino_gateway::Gateway;
use clino_modbus::binding::{Binding, Site, Wish};
use clino_modbus::{Counters, Identification, Refusal, Server, Settings};
use clino_recovery::{Duty, Start};
use cortex_m::peripheral::NVIC;
use critical_section::Mutex;
use heapless::spsc::{Consumer, Producer};
use stm32f4xx_hal::pac::{Interrupt, interrupt};

use crate::ceiling::Ceiling;
use crate::clock::Level;
use crate::ports::priority;
use crate::{bus, clock, keeper, params, ports, shared, start, watchdog};

pub mod port;

use port::Event;

/// The interrupt line is borrowed from EXTI1, which has nothing connected here; only software raises it.
pub const INTERRUPT: Interrupt = Interrupt::EXTI1;

const IDENTIFICATION: Identification = Identification([
    "clino",
    "clino-f407",
    env!("CARGO_PKG_VERSION"),
    env!("CARGO_PKG_REPOSITORY"),
    "Inclinometer gateway",
    "STM32F407",
]);

/// What the level moves characters with.
pub struct Lines {
    pub events: Consumer<'static, Event>,
    pub answer: Producer<'static, u8>,
}

struct ModbusLevel {
    lines: Lines,
    server: Server,
    binding: Binding<'static, Board>,
}

/// What the people level is asked for, and whether it has done it.
static WISH: Mutex<Cell<Option<Wish>>> = Mutex::new(Cell::new(None));
static DONE: Mutex<Cell<Option<bool>>> = Mutex::new(Cell::new(None));

/// How the port runs, for those who ask while the level itself is running.
static SETTINGS: Mutex<Cell<Settings>> = Mutex::new(Cell::new(params::MODBUS));

static LEVEL: Ceiling<ModbusLevel, { priority::MODBUS }> = Ceiling::new();

/// Makes the level ready to run; it does once its interrupt is let in.
#[inline(never)]
pub fn start(lines: Lines, settings: Settings) {
    note(settings);
    LEVEL.fill(|place| {
        place.write(ModbusLevel {
            lines,
            server: Server::new(settings, &IDENTIFICATION, clock::now()),
            binding: Binding::new(Board, &shared::SNAPSHOT),
        })
    });
    wake();
}

/// Runs the level soon: at once if nothing of higher priority is running.
pub fn wake() {
    NVIC::pend(INTERRUPT);
}

/// What the people level is to do for the Modbus master.
pub fn wish() -> Option<Wish> {
    critical_section::with(|cs| WISH.borrow(cs).take())
}

/// The people level has done it, or has failed.
pub fn done(well: bool) {
    critical_section::with(|cs| DONE.borrow(cs).set(Some(well)));
    wake();
}

/// Whether a command of the master is under way.
pub fn has_command() -> bool {
    LEVEL.with(|level| level.binding.has_command()).unwrap_or(false)
}

/// What happened on the port.
pub fn counters() -> Option<Counters> {
    LEVEL.with(|level| *level.server.counters())
}

/// How the port runs.
pub fn settings() -> Settings {
    critical_section::with(|cs| SETTINGS.borrow(cs).get())
}

fn note(settings: Settings) {
    critical_section::with(|cs| SETTINGS.borrow(cs).set(settings));
}

/// Runs the port like this. A request in hand is lost.
pub fn set(settings: Settings) {
    LEVEL.with(|level| level.server.set(settings, clock::now()));
    wake();
}

#[interrupt]
fn EXTI1() {
    LEVEL.with(ModbusLevel::run);
}

impl ModbusLevel {
    fn run(&mut self) {
        // What comes in after this look is for the next run.
        let now = clock::now();
        while let Some(event) = self.lines.events.dequeue() {
            match event {
                Event::Heard { character, at } => self.server.heard(character, at.near(now)),
                Event::Sent { at } => self.server.sent(at.near(now)),
            }
        }
        self.binding.poll();
        if let Some(well) = critical_section::with(|cs| DONE.borrow(cs).take()) {
            self.binding.done(well);
        }
        if let Some(answer) = self.server.poll(now, &mut self.binding) {
            for &byte in answer {
                // There is room for the longest frame, and the one before is out.
                _ = self.lines.answer.enqueue(byte);
            }
            port::send();
        }
        if let Some(settings) = self.server.reconfigured() {
            port::run(&settings);
            note(settings);
        }
        let next = self.server.poll_at();
        if next.is_none_or(|at| at > now) {
            watchdog::check_in(Duty::Modbus);
        }
        if let Some(at) = next {
            clock::wake_at(Level::Modbus, at);
        }
    }
}

/// The board as the Modbus server sees it: all of it is shared, so there is nothing to hold.
struct Board;

impl Site for Board {
    fn now(&self) -> Micros {
        clock::now()
    }

    fn gateway<R>(&self, look: impl FnOnce(&mut Gateway) -> R) -> Option<R> {
        bus::with(look)
    }

    fn wake(&self) {
        bus::wake();
    }

    fn driver_enable(&self, bus: clino_gateway::Bus) -> DriverEnable {
        ports::driver_enable(bus)
    }

    fn version(&self) -> (u8, u8, u16) {
        params::VERSION
    }

    fn start(&self) -> Start {
        start::start()
    }

    fn ask(&self, wish: Wish) -> Result<(), Refusal> {
        let before = critical_section::with(|cs| WISH.borrow(cs).replace(Some(wish)));
        shared::note_work();
        if before.is_some() { Err(Refusal::Busy) } else { Ok(()) }
    }

    fn is_unsaved(&self) -> bool {
        keeper::is_unsaved()
    }

    fn has_unread(&self) -> bool {
        keeper::has_unread()
    }
}
