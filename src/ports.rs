//! The ports that an interrupt and the bus level share, and the interrupts with their priorities.
//!
//! A port is borrowed only inside a critical section and only for a few register accesses.

use core::cell::RefCell;

use clino_bus::{DriverEnable, Micros, Timing, earliest, line};
use clino_gateway::Bus;
use clino_recovery::Mode;
use cortex_m::peripheral::NVIC;
use critical_section::Mutex;
use stm32f4xx_hal::pac::{Interrupt, interrupt};

use crate::board::{IsuPort, Pwm1Port, Pwm2Port, T7Port};
use crate::clock;
use crate::log::log;

/// Everything the bus level moves bytes and ticks with.
pub struct Ports {
    pub t7: T7Port,
    pub isu: IsuPort,
    pub pwm1: Pwm1Port,
    pub pwm2: Pwm2Port,
}

static PORTS: Mutex<RefCell<Option<Ports>>> = Mutex::new(RefCell::new(None));

/// Interrupt priorities, highest first; above them is the watchdog's tick. The F4 implements the upper four bits of the byte
/// (RM0090 section 12).
pub mod priority {
    /// Characters and edges, and the clock that stamps them.
    pub const BYTES: u8 = 1 << 4;
    /// The characters of the console and of Modbus can wait for those of the buses.
    pub const CONSOLE: u8 = 2 << 4;
    /// The bus level: above the levels that talk to others, below every character.
    pub const BUS: u8 = 3 << 4;
    /// The Modbus level: above the main loop, which may wait for the console.
    pub const MODBUS: u8 = 4 << 4;
}

/// What serves the sensors.
const SENSORS: [(Interrupt, u8); 5] = [
    (Interrupt::USART1, priority::BYTES),
    (Interrupt::USART3, priority::BYTES),
    (Interrupt::TIM5, priority::BYTES),
    (Interrupt::TIM2, priority::BYTES),
    (crate::bus::INTERRUPT, priority::BUS),
];

/// What serves people and the Modbus master, in safe mode, too.
const UPLINKS: [(Interrupt, u8); 4] = [
    (Interrupt::TIM4, priority::BYTES),
    (Interrupt::USART2, priority::CONSOLE),
    (Interrupt::USART6, priority::CONSOLE),
    (crate::modbus::INTERRUPT, priority::MODBUS),
];

/// Takes the ports into service and lets the interrupts in.
#[inline(never)]
pub fn start(ports: Ports, mode: Mode, nvic: &mut NVIC) {
    critical_section::with(|cs| PORTS.replace(cs, Some(ports)));
    let sensors = if mode == Mode::Normal { &SENSORS[..] } else { &[] };
    for &(number, priority) in UPLINKS.iter().chain(sensors) {
        // SAFETY: critical sections here mask by PRIMASK, which no priority escapes; and everything the
        // handlers use was set up before this line.
        unsafe {
            nvic.set_priority(number, priority);
            NVIC::unmask(number);
        }
    }
}

/// Gives a frame to a bus's line.
pub fn submit(bus: Bus, frame: &[u8]) {
    let accepted = with(|ports| match bus {
        Bus::T7 => ports.t7.submit(frame),
        Bus::Isu => ports.isu.submit(frame),
    });
    if let Some(Err(error)) = accepted {
        // The master's own deadline ends the exchange.
        log!(warn, "frame not accepted: {}", error);
    }
}

/// Runs a bus with another bit rate and other waits. Only between two exchanges.
pub fn run(bus: Bus, timing: &Timing, line: line::LineSettings) {
    with(|ports| match bus {
        Bus::T7 => ports.t7.run(timing, line),
        Bus::Isu => ports.isu.run(timing, line),
    });
}

/// Lets time pass in all ports; returns when they want it again. One port at a time, so that no interrupt waits for all.
pub fn poll() -> Option<Micros> {
    // The buses look at the clock themselves: how long a driver may be on counts from the instant it is switched on.
    let t7 = with(|ports| {
        ports.t7.poll();
        ports.t7.poll_at()
    });
    let isu = with(|ports| {
        ports.isu.poll();
        ports.isu.poll_at()
    });
    let now = clock::now();
    let pwm1 = with(|ports| {
        ports.pwm1.poll(now);
        ports.pwm1.poll_at()
    });
    let pwm2 = with(|ports| {
        ports.pwm2.poll(now);
        ports.pwm2.poll_at()
    });
    [t7.flatten(), isu.flatten(), pwm1, pwm2].into_iter().fold(None, earliest)
}

/// Whether a bus's line driver is on.
pub fn is_driving() -> bool {
    with(|ports| ports.t7.is_driving() || ports.isu.is_driving()).unwrap_or(false)
}

/// How a bus's driver enable behaved since reset.
pub fn driver_enable(bus: Bus) -> DriverEnable {
    with(|ports| match bus {
        Bus::T7 => ports.t7.driver_enable(),
        Bus::Isu => ports.isu.driver_enable(),
    })
    .unwrap_or_default()
}

/// Borrows the ports, once they are in service.
fn with<R>(work: impl FnOnce(&mut Ports) -> R) -> Option<R> {
    critical_section::with(|cs| PORTS.borrow_ref_mut(cs).as_mut().map(work))
}

#[interrupt]
fn USART1() {
    with(|ports| ports.t7.on_interrupt());
}

#[interrupt]
fn USART3() {
    with(|ports| ports.isu.on_interrupt());
}

#[interrupt]
fn TIM5() {
    with(|ports| ports.pwm1.on_interrupt());
}

#[interrupt]
fn TIM2() {
    with(|ports| ports.pwm2.on_interrupt());
}
