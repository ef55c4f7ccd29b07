//! clino: reads inclinometers over RS485 and PWM and serves their angles.
//!
//! Four levels of work, each interrupting the one below:
//!
//! 1. *Bytes* (`ports`, `uart`, `capture`, `console`, `clock`): interrupt handlers that move bytes and ticks between
//!    registers and queues, and switch the line driver.
//! 2. *Bus* (`bus`): a software interrupt that hands events and `now` to the gateway core, sends what it
//!    wants sent, publishes what it has read (`shared`), and sets the alarm for the next deadline.
//! 3. *Modbus* (`modbus`): a software interrupt that answers the Modbus master.
//! 4. *People* (this loop): the console, and sleep.
//!
//! Above them all the tick of the watchdog (`watchdog`), which expects every level to check in. After three fast crashes
//! in a row the bus level does not run, nor do its ports (safe mode, `clino_recovery`).
//!
//! No level waits for one below, but for the short looks into the gateway (`ceiling`): the bus never waits for the console.
#![no_std]
#![no_main]
#![deny(unsafe_op_in_unsafe_fn)]

mod board;
mod bus;
mod capture;
mod ceiling;
mod clock;
mod console;
mod faults;
mod flash;
mod keeper;
mod log;
mod modbus;
mod params;
mod people;
mod ports;
mod shared;
mod start;
mod uart;
mod watchdog;

use clino_console::Shell;
use clino_recovery::Mode;
use cortex_m_rt::entry;
use stm32f4xx_hal::pac;

use crate::board::{Board, Queues};
use crate::console::Console;
use crate::people::Gateway;

#[entry]
fn main() -> ! {
    static mut QUEUES: Queues = Queues::new();
    let (Some(mut core), Some(peripherals)) = (cortex_m::Peripherals::take(), pac::Peripherals::take())
    else {
        panic!("somebody else took the peripherals");
    };
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
    let Board { mode, keys, keeper } = Board::init(peripherals, &mut core.NVIC, QUEUES);
    watchdog::begin(core.SYST, &mut core.SCB, mode);
    serve(mode, Gateway { keeper, keys })
}

/// The people level. The console is on its stack for good: 1.4 KB.
fn serve(mode: Mode, mut host: Gateway) -> ! {
    let mut shell = Shell::new(Console);
    loop {
        if mode != Mode::Normal && clock::now() >= params::SAFE_MODE {
            start::retry();
        }
        if let Some(key) = host.keys.dequeue() {
            shell.input(key, &mut host);
        } else if let Some(wish) = modbus::wish() {
            modbus::done(host.fulfil(wish));
        } else if !(Console.has_room() && shell.poll(&mut host)) {
            shared::sleep_until_work();
        }
    }
}
