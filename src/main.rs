//! clino: reads inclinometers over RS485 and PWM and serves their angles.
//!
//! Levels of work, each interrupting the one below:
//!
//! 1. *Bytes* (`ports`, `uart`, `capture`, `console`, `clock`): interrupt handlers that move bytes and ticks between
//!    registers and queues, and switch the line driver.
//! 2. *Bus* (`bus`): a software task that hands events and `now` to the gateway core, sends its
//!    requests, publishes its readings, and sets the alarm for the next deadline.
//! 3. *Modbus* (`modbus`): a software task that answers the Modbus master.
//! 4. *Main loop* (`foreground`): the console, and sleep.
//!
//! Above them all the tick of the watchdog (`watchdog`), which expects every level to check in. After three fast
//! crashes in a row the bus level does not run, nor do its ports (safe mode, `clino_recovery`).
//!
//! This file names every interrupt, its priority, and what each level shares with others: RTIC checks the priorities. A
//! lock of a resource holds off the tasks that share it, and no task of a higher priority. A level waits for one below
//! only while that holds a lock: the bus never waits for the console.
#![no_std]
#![no_main]
#![deny(unsafe_op_in_unsafe_fn)]
// What only some of the parts need; the linker leaves it out.
#![cfg_attr(not(feature = "full"), allow(dead_code, unused_imports))]

#[cfg(not(any(feature = "console", feature = "modbus")))]
compile_error!("nothing would serve the angles: choose `console` or `modbus`, or both");

mod board;
mod bring_up;
mod bus;
#[cfg(feature = "pwm")]
mod capture;
mod clock;
#[cfg(feature = "storage")]
mod config_store;
#[cfg(feature = "console")]
mod console;
mod events;
mod faults;
mod flash;
#[cfg(feature = "console")]
mod foreground;
#[cfg(feature = "isu")]
mod isu;
mod log;
mod main_loop;
#[cfg(feature = "modbus")]
mod modbus;
mod params;
mod ports;
mod pre_init;
#[cfg(feature = "pwm")]
mod pwm;
mod quiet;
mod shared;
mod start;
mod uart;
#[cfg(not(feature = "console"))]
mod unattended;
mod watchdog;

// What is left out has something in its place that does nothing.
#[cfg(not(feature = "console"))]
mod no_console;
#[cfg(not(feature = "console"))]
use no_console as console;
#[cfg(not(feature = "storage"))]
mod no_config_store;
#[cfg(not(feature = "isu"))]
mod no_isu;
#[cfg(not(feature = "modbus"))]
mod no_modbus;
#[cfg(not(feature = "pwm"))]
mod no_pwm;
#[cfg(feature = "console")]
use foreground::serve;
#[cfg(not(feature = "storage"))]
use no_config_store as config_store;
#[cfg(not(feature = "isu"))]
use no_isu as isu;
#[cfg(not(feature = "modbus"))]
use no_modbus as modbus;
#[cfg(not(feature = "pwm"))]
use no_pwm as pwm;
#[cfg(not(feature = "console"))]
use unattended::serve;

/// Priorities: the higher the number, the more urgent. The watchdog's tick is above all of them (`watchdog.rs`).
///
/// | priority | |
/// |---|---|
/// | 4 | characters and edges, and the clock that stamps them |
/// | 3 | the characters of the console and of Modbus, which can wait for those of the buses |
/// | 2 | the bus level: above the levels that talk to others, below every character |
/// | 1 | the Modbus level: above the main loop, which may wait for the console |
///
/// The software tasks borrow two interrupt lines that have nothing connected here; the most urgent task has the last of
/// them.
#[rtic::app(device = stm32f4xx_hal::pac, peripherals = true, dispatchers = [EXTI1, EXTI0])]
mod app {
    use core::cell::RefCell;
    use core::mem::MaybeUninit;

    use clino_gateway::Gateway;
    use clino_modbus::binding::DeferredRequest;
    use clino_modbus::{Counters, Settings};
    use clino_recovery::{Mode, Start};
    use stm32f4xx_hal::pac::Interrupt;

    use crate::board::{self, Board};
    use crate::bring_up::{self, Places, Queues};
    use crate::bus::Inbox;
    use crate::config_store::ConfigStore;
    use crate::flash::ConfigurationFlash;
    use crate::modbus::Server;
    use crate::ports::T7Port;
    use crate::quiet::Kept;
    use crate::{bus, clock, console, isu, modbus, pwm, serve, shared, watchdog};

    /// The interrupts of the sensors' ports, which safe mode leaves off.
    const SENSORS: [Interrupt; 4] = [Interrupt::USART1, Interrupt::USART3, Interrupt::TIM5, Interrupt::TIM2];

    #[shared]
    struct Shared {
        t7: T7Port,
        isu: isu::Port,
        pwm1: pwm::Port1,
        pwm2: pwm::Port2,
        console: console::Port,
        uplink: modbus::port::Port,
        timer: clock::Timer,
        gateway: &'static mut Gateway,
        /// How the Modbus port runs.
        settings: Settings,
        /// How it is to run from now on.
        new_settings: Option<Settings>,
        /// Whether a command of the Modbus master is under way.
        has_command: bool,
        /// What happened on the Modbus port.
        port_counters: Counters,
        /// A request of the Modbus master that the main loop is to carry out.
        deferred: Option<DeferredRequest>,
        /// Whether it has done it.
        done: Option<bool>,
        /// Content of the stored configuration, as far as it is known.
        kept: Kept,
    }

    #[local]
    struct Local {
        start: &'static Start,
        start_for_modbus: &'static Start,
        keys: console::Keys,
        writer: console::Writer,
        store: &'static mut ConfigStore,
        inbox: Inbox,
        lines: modbus::Lines,
        server: &'static mut Server,
    }

    /// RTIC has let in all interrupts by their numbers, and holds them off until this is over.
    #[init(local = [
        queues: Queues = Queues::new(),
        start_place: MaybeUninit<Start> = MaybeUninit::uninit(),
        gateway_place: MaybeUninit<Gateway> = MaybeUninit::uninit(),
        server_place: MaybeUninit<Server> = MaybeUninit::uninit(),
        flash_place: MaybeUninit<ConfigurationFlash> = MaybeUninit::uninit(),
        store_place: MaybeUninit<ConfigStore> = MaybeUninit::uninit(),
    ])]
    fn init(mut cx: init::Context) -> (Shared, Local) {
        board::count_cycles(&mut cx.core);
        let places = Places {
            queues: cx.local.queues,
            start: cx.local.start_place,
            gateway: cx.local.gateway_place,
            server: cx.local.server_place,
            flash: cx.local.flash_place,
            store: cx.local.store_place,
        };
        let parts = bring_up::bring_up(Board::new(cx.device), places);
        if parts.start.mode == Mode::Normal {
            _ = bus_level::spawn();
        } else {
            SENSORS.into_iter().for_each(board::mask);
        }
        _ = modbus_level::spawn();
        watchdog::begin(cx.core, parts.start.mode);
        let shared = Shared {
            t7: parts.t7,
            isu: parts.isu,
            pwm1: parts.pwm1,
            pwm2: parts.pwm2,
            console: parts.console,
            uplink: parts.uplink,
            timer: parts.timer,
            gateway: parts.gateway,
            settings: parts.settings,
            new_settings: None,
            has_command: false,
            port_counters: Counters::default(),
            deferred: None,
            done: None,
            kept: parts.kept,
        };
        let local = Local {
            start: parts.start,
            start_for_modbus: parts.start,
            keys: parts.keys,
            writer: parts.writer,
            store: parts.store,
            inbox: parts.inbox,
            lines: parts.lines,
            server: parts.server,
        };
        (shared, local)
    }

    #[idle(
        local = [start, keys, writer, store],
        shared = [t7, isu, console, uplink, gateway, settings, new_settings, has_command, port_counters, deferred, done, kept]
    )]
    fn idle(cx: idle::Context) -> ! {
        serve(cx.local, cx.shared)
    }

    #[task(binds = USART1, priority = 4, shared = [t7])]
    fn t7_port(mut cx: t7_port::Context) {
        if cx.shared.t7.lock(|port| port.on_interrupt()) {
            shared::wake_bus();
        }
    }

    #[task(binds = USART3, priority = 4, shared = [isu])]
    fn isu_port(mut cx: isu_port::Context) {
        if cx.shared.isu.lock(|port| port.on_interrupt()) {
            shared::wake_bus();
        }
    }

    #[task(binds = TIM5, priority = 4, shared = [pwm1])]
    fn pwm1_port(mut cx: pwm1_port::Context) {
        if cx.shared.pwm1.lock(|port| port.on_interrupt()) {
            shared::wake_bus();
        }
    }

    #[task(binds = TIM2, priority = 4, shared = [pwm2])]
    fn pwm2_port(mut cx: pwm2_port::Context) {
        if cx.shared.pwm2.lock(|port| port.on_interrupt()) {
            shared::wake_bus();
        }
    }

    #[task(binds = TIM4, priority = 4, shared = [timer])]
    fn clock_tick(mut cx: clock_tick::Context) {
        let rung = cx.shared.timer.lock(|timer| timer.on_interrupt());
        if rung.round {
            // The main loop looks at the time, too.
            shared::note_work();
        }
        if rung.bus || rung.round {
            shared::wake_bus();
        }
        if rung.modbus || rung.round {
            shared::wake_modbus();
        }
    }

    #[task(binds = USART2, priority = 3, shared = [console])]
    fn console_port(mut cx: console_port::Context) {
        cx.shared.console.lock(|port| port.on_interrupt());
    }

    #[task(binds = USART6, priority = 3, shared = [uplink])]
    fn modbus_port(mut cx: modbus_port::Context) {
        if cx.shared.uplink.lock(|port| port.on_interrupt()) {
            shared::wake_modbus();
        }
    }

    #[task(priority = 2, local = [inbox], shared = [gateway, t7, isu, pwm1, pwm2, timer])]
    async fn bus_level(mut cx: bus_level::Context) -> ! {
        loop {
            if !bus::run(&mut cx.local, &mut cx.shared) {
                shared::woken().await;
            }
        }
    }

    #[task(
        priority = 1,
        local = [lines, server, start_for_modbus],
        shared = [gateway, t7, isu, uplink, timer, settings, new_settings, has_command, port_counters, deferred, done, kept]
    )]
    async fn modbus_level(cx: modbus_level::Context) -> ! {
        let shared = RefCell::new(cx.shared);
        let mut level =
            modbus::Level::new(cx.local.lines, cx.local.server, cx.local.start_for_modbus, &shared);
        loop {
            if !level.run() {
                shared::woken().await;
            }
        }
    }
}
