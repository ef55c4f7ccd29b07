//! The bus level: a software interrupt in which the gateway core runs.
//!
//! Any port, the clock's alarm and the clock's rounds raise it. Each run hands the core what has come in, sends
//! what it wants sent, publishes what it has read, and sets the alarm for the next deadline.
//!
//! The levels below give orders and ask for details with [`with`], which holds this level off for as long as it takes.

use clino_bus::{Event, Micros, Timing, earliest};
use clino_codec::pwm;
use clino_console::BusState;
use clino_gateway::{Action, Asker, Bus, Capture, Gateway, Publisher, PwmInput, Restraint};
use clino_recovery::MonitoredTask;
use cortex_m::peripheral::NVIC;
use heapless::spsc::Consumer;
use stm32f4xx_hal::pac::{Interrupt, interrupt};

use crate::ceiling::Ceiling;
use crate::clock::Level;
use crate::modbus;
use crate::ports::priority;
use crate::{clock, params, ports, shared, watchdog};

/// The interrupt line is borrowed from EXTI0, which has nothing connected here; only software raises it.
pub const INTERRUPT: Interrupt = Interrupt::EXTI0;

/// What the ports have for the bus level.
pub struct Inbox {
    pub t7: Consumer<'static, Event>,
    pub isu: Consumer<'static, Event>,
    pub pwm1: Consumer<'static, Capture>,
    pub pwm2: Consumer<'static, Capture>,
}

struct BusLevel {
    inbox: Inbox,
    gateway: Gateway,
    snapshot: Publisher<'static>,
}

static LEVEL: Ceiling<BusLevel, { priority::BUS }> = Ceiling::new();

/// Makes the gateway, with the configuration as delivered.
#[inline(never)]
pub fn prepare(inbox: Inbox, pwm: pwm::Limits) {
    LEVEL.fill(|place| {
        place.write(BusLevel { gateway: Gateway::idle(pwm), inbox, snapshot: shared::SNAPSHOT.publisher() })
    });
    with(|gateway| gateway.set_up(&params::SLOTS, &params::T7, &params::ISU));
}

/// The bus level runs once its interrupt is let in.
pub fn start(restraint: Restraint) {
    with(|gateway| gateway.restrain(restraint));
    wake();
}

/// Runs the bus level soon: at once if nothing of higher priority is running.
pub fn wake() {
    NVIC::pend(INTERRUPT);
}

/// Lends the gateway to a level below. The bus level waits meanwhile: look at one thing at a time.
pub fn with<R>(work: impl FnOnce(&mut Gateway) -> R) -> Option<R> {
    LEVEL.with(|level| work(&mut level.gateway))
}

/// Does something with the gateway that may stall the core, while no line driver is on and none can be switched on; `None`
/// if one is on now.
///
/// A driver that is on while the core stands still holds its line against everybody. An answer that comes in meanwhile is
/// lost, and asked for again.
pub fn while_silent<R>(work: impl FnOnce(&Gateway) -> R) -> Option<R> {
    let silent = || !ports::is_driving() && !modbus::port::is_driving();
    LEVEL.with(|level| silent().then(|| work(&level.gateway))).flatten()
}

/// The bit rate of a bus, and its waits.
pub fn timing(bus: Bus) -> Timing {
    with(|gateway| gateway.bus_settings(bus).timing).unwrap_or(match bus {
        Bus::T7 => params::T7.timing,
        Bus::Isu => params::ISU.timing,
    })
}

/// What happened on a bus since reset, and how it is set.
pub fn state(bus: Bus) -> Option<BusState> {
    with(|gateway| BusState {
        settings: *gateway.bus_settings(bus),
        in_force: gateway.is_in_force(bus),
        counters: *gateway.counters(bus),
        health: gateway.health(bus),
        driver: ports::driver_enable(bus),
        progress: gateway.progress(bus),
    })
}

#[interrupt]
fn EXTI0() {
    LEVEL.with(BusLevel::run);
}

impl BusLevel {
    fn run(&mut self) {
        let now = clock::now();
        self.fetch(now);
        for bus in shared::BUSES {
            self.gateway.poll(bus, now, |action| match action {
                Action::Send(frame) => ports::submit(bus, frame),
                Action::Run(timing, line) => ports::run(bus, &timing, line),
            });
        }
        let ports_at = ports::poll();
        for (bus, task) in [(Bus::T7, MonitoredTask::T7Bus), (Bus::Isu, MonitoredTask::IsuBus)] {
            // A bus that still wants something of the past has not gone on.
            if self.gateway.poll_at(bus).is_none_or(|at| at > now) {
                watchdog::check_in(task);
            }
        }
        if self.gateway.publish(&mut self.snapshot) || self.gateway.has_news(Asker::Console) {
            shared::note_work();
        }
        if self.gateway.has_news(Asker::Modbus) {
            modbus::wake();
        }
        let gateway_at = shared::BUSES.map(|bus| self.gateway.poll_at(bus)).into_iter().fold(None, earliest);
        if let Some(at) = earliest(ports_at, gateway_at) {
            clock::wake_at(Level::Bus, at);
        }
    }

    fn fetch(&mut self, now: Micros) {
        while let Some(event) = self.inbox.t7.dequeue() {
            self.gateway.line(Bus::T7, event);
        }
        while let Some(event) = self.inbox.isu.dequeue() {
            self.gateway.line(Bus::Isu, event);
        }
        while let Some(capture) = self.inbox.pwm1.dequeue() {
            self.gateway.pwm(PwmInput::Pwm1, capture, now);
        }
        while let Some(capture) = self.inbox.pwm2.dequeue() {
            self.gateway.pwm(PwmInput::Pwm2, capture, now);
        }
        watchdog::check_in(MonitoredTask::Pwm);
    }
}
