//! Brings the board up: every role of it gets its driver, and what runs on them is made where it stays.

use core::mem::MaybeUninit;

use clino_codec::pwm::Limits;
use clino_gateway::{Bus, Capture, Configuration, DegradedMode, Gateway};
use clino_modbus::Settings;
use clino_recovery::{Clock, Mode, Start};
use clino_storage::Tally;
use heapless::spsc::Queue;

use crate::board::{self, Board, FlashRegisters};
use crate::bus::Inbox;
use crate::config_store::ConfigStore;
use crate::flash::{ConfigurationFlash, TallyFlash};
use crate::log::log;
use crate::modbus::{Lines, Server};
use crate::ports::T7Port;
use crate::quiet::Kept;
use crate::uart::Rs485;
use crate::{clock, console, events, isu, modbus, params, pwm, start, watchdog};

/// Events the T7 bus can have in hand before the bus level fetches them: 2.8 ms of characters at 115200 bit/s.
const T7_EVENTS: usize = 32;
/// The same for the ISU bus: 17 ms at 9600 bit/s.
const ISU_EVENTS: usize = 16;
/// Cycles a PWM input can have in hand.
const CAPTURES: usize = 4;

/// The queues between interrupts and the levels below them.
pub struct Queues {
    t7: events::Queue<T7_EVENTS>,
    isu: events::Queue<ISU_EVENTS>,
    pwm1: Queue<Capture, CAPTURES>,
    pwm2: Queue<Capture, CAPTURES>,
    console: console::Queues,
    modbus: modbus::port::Queues,
}

impl Queues {
    pub const fn new() -> Queues {
        Queues {
            t7: Queue::new(),
            isu: Queue::new(),
            pwm1: Queue::new(),
            pwm2: Queue::new(),
            console: console::Queues::new(),
            modbus: modbus::port::Queues::new(),
        }
    }
}

/// Places in which large values are made: a value that a function returns would be on the stack first.
pub struct Places {
    pub queues: &'static mut Queues,
    pub start: &'static mut MaybeUninit<Start>,
    pub gateway: &'static mut MaybeUninit<Gateway>,
    pub server: &'static mut MaybeUninit<Server>,
    pub flash: &'static mut MaybeUninit<ConfigurationFlash>,
    pub store: &'static mut MaybeUninit<ConfigStore>,
}

/// Everything, ready to run.
pub struct Parts {
    /// How the board has started, and the mode in which it runs.
    pub start: &'static Start,
    pub timer: clock::Timer,
    pub gateway: &'static mut Gateway,
    pub inbox: Inbox,
    pub t7: T7Port,
    pub isu: isu::Port,
    pub pwm1: pwm::Port1,
    pub pwm2: pwm::Port2,
    pub server: &'static mut Server,
    pub uplink: modbus::port::Port,
    pub lines: Lines,
    /// How the Modbus port runs.
    pub settings: Settings,
    pub console: console::Port,
    /// Characters received by the console.
    pub keys: console::Keys,
    /// Text to be printed.
    pub writer: console::Writer,
    pub store: &'static mut ConfigStore,
    pub kept: Kept,
}

/// Brings the board up, with all interrupts held off. A function of its own: its share of the stack is free again after
/// it.
#[inline(never)]
pub fn bring_up(board: Board, places: Places) -> Parts {
    watchdog::start(&board.watchdog);
    let start = start::note(board.reset.cause());
    let (clock, mut rcc) = board.reset.start_clocks(start.clock);
    let (power_ups, flash) = count_power_ups(board.flash, &start);
    let start: &'static Start = places.start.write(Start { clock, power_ups, ..start });
    tell(start);
    let rcc = &mut rcc;
    let timer = clock::Timer::start(board.clock, rcc);

    let queues = places.queues;
    let (t7_producer, t7) = queues.t7.split();
    let (isu_producer, isu) = queues.isu.split();
    let (pwm1_producer, pwm1) = queues.pwm1.split();
    let (pwm2_producer, pwm2) = queues.pwm2.split();
    let inbox = Inbox { t7, isu, pwm1, pwm2 };
    let gateway = make_gateway(places.gateway, params::pwm_limits(board::capture_hz(rcc), clock.is_exact()));
    let ports = board.ports.split(rcc);
    let mut settings = params::MODBUS;
    let flash = places.flash.write(ConfigurationFlash::new(flash));
    let store = places.store.write(ConfigStore::new(flash, gateway));
    let kept = match start.mode {
        Mode::Bare => store.leave(),
        Mode::Normal | Mode::Safe => store.load(gateway, &mut settings),
    };
    gateway.degrade(degraded(start.mode, clock));
    let core_hz = rcc.clocks.hclk().raw();

    let (usart, de, clock_hz) = ports.t7.start(rcc);
    let t7 = Rs485::new(usart, de, &gateway.bus_settings(Bus::T7).timing, clock_hz, core_hz, t7_producer);
    let isu = isu::start(ports.isu, rcc, &gateway.bus(Bus::Isu).timing, core_hz, isu_producer);
    let (console, keys, writer) = console::start(ports.console, rcc, &mut queues.console);
    let (uplink, lines) = modbus::start(ports.modbus, rcc, &settings, &mut queues.modbus);
    let server = make_server(places.server, settings);
    let (pwm1, pwm2) = pwm::start(ports.pwm1, ports.pwm2, rcc, pwm1_producer, pwm2_producer);
    Parts {
        start,
        timer,
        gateway,
        inbox,
        t7,
        isu,
        pwm1,
        pwm2,
        server,
        uplink,
        lines,
        settings,
        console,
        keys,
        writer,
        store,
        kept,
    }
}

/// Number of power-ups. The first start after each counts it.
#[inline(never)]
fn count_power_ups(flash: FlashRegisters, start: &Start) -> (u32, FlashRegisters) {
    let mut tally = Tally::new(TallyFlash::new(flash));
    let counted = if start.boots == 1 { tally.add() } else { tally.count() };
    (counted.unwrap_or(0), tally.into_flash().release())
}

/// Logs how the board has started.
fn tell(start: &Start) {
    log!(
        info,
        "clino {=str}, start {=u32} after {=str}, {=u32} crashes, mode {=str}, clock {=str}",
        env!("CARGO_PKG_VERSION"),
        start.boots,
        start.cause.name(),
        start.crashes,
        start.mode.name(),
        start.clock.name()
    );
    if let Some(crash) = start.crash {
        let at = crash.registers.unwrap_or_default();
        log!(
            error,
            "last crash: {=str} {=u32} {=str} in start {=u32} after {=u32} ms, pc {=u32:#010x}, lr {=u32:#010x}, \
             level {=u16}, cfsr {=u32:#010x}, address {=u32:#010x}",
            crash.cause.name(),
            crash.detail,
            crash.file().unwrap_or(""),
            crash.boot,
            crash.uptime_ms,
            at.pc,
            at.lr,
            at.exception,
            crash.fault.cfsr,
            crash.fault.address
        );
    }
}

/// Makes the gateway, with the configuration as delivered.
#[inline(never)]
fn make_gateway(place: &'static mut MaybeUninit<Gateway>, limits: Limits) -> &'static mut Gateway {
    let gateway = place.write(Gateway::idle(limits));
    gateway.set_up(params::SLOTS, &params::T7, &params::ISU);
    gateway
}

/// A function of its own: its stack is not below the rest.
#[inline(never)]
fn make_server(place: &'static mut MaybeUninit<Server>, settings: Settings) -> &'static mut Server {
    place.write(modbus::server(settings))
}

/// Operations that the gateway refuses in this mode.
fn degraded(mode: Mode, clock: Clock) -> DegradedMode {
    if mode != Mode::Normal {
        DegradedMode::NoBuses
    } else if !clock.is_exact() {
        DegradedMode::InexactClock
    } else {
        DegradedMode::None
    }
}
