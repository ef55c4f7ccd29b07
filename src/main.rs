//! clino: reads inclinometers over RS485 and PWM and serves their angles.
//!
//! Three levels of work, each interrupting the one below:
//!
//! 1. *Bytes* (`ports`, `uart`, `capture`, `console`, `clock`): interrupt handlers that move bytes and ticks between
//!    registers and queues, and switch the line driver.
//! 2. *Bus* (`bus`): a software interrupt that hands events and `now` to the gateway core, sends what it
//!    wants sent, publishes what it has read, and sets the alarm for the next deadline.
//! 3. *People* (this loop): the console, and sleep.
//!
//! No level waits for another: the bus never waits for the console.
#![no_std]
#![no_main]
#![deny(unsafe_op_in_unsafe_fn)]

mod board;
mod bus;
mod capture;
mod clock;
mod console;
mod faults;
mod params;
mod ports;
mod shared;
mod uart;

use clino_bus::Micros;
use clino_console::{BusState, Shell};
use clino_gateway::order::{Order, Refusal};
use clino_gateway::task::News;
use clino_gateway::{Bus, Reading};
use cortex_m_rt::entry;
use defmt_rtt as _;
use heapless::spsc::{Consumer, Producer};
use stm32f4xx_hal::pac;

use crate::board::{Board, Queues};
use crate::console::Console;

#[entry]
fn main() -> ! {
    static mut QUEUES: Queues = Queues::new();
    let (Some(mut core), Some(peripherals)) = (cortex_m::Peripherals::take(), pac::Peripherals::take())
    else {
        panic!("somebody else took the peripherals");
    };
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
    let Board { mut keys, orders, told, news, ports, inbox, gateway, clock_source } =
        Board::init(peripherals, QUEUES);
    defmt::info!("clino {=str}, clock: {}", env!("CARGO_PKG_VERSION"), clock_source);
    bus::start(inbox, news, gateway);
    ports::start(ports, &mut core.NVIC);
    let mut shell = Shell::new(Console);
    let mut host = Host { orders, told };
    loop {
        if let Some(key) = keys.dequeue() {
            shell.input(key, &mut host);
        } else if !(Console.has_room() && shell.poll(&mut host)) {
            shared::sleep_until_work();
        }
    }
}

/// The gateway as the console sees it.
struct Host {
    orders: Producer<'static, Order>,
    told: Consumer<'static, News>,
}

impl clino_console::Host for Host {
    fn now(&self) -> Micros {
        clock::now()
    }

    fn reading(&self, slot: usize) -> Option<Reading> {
        shared::reading(slot)
    }

    fn bus(&self, bus: Bus) -> Option<BusState> {
        shared::bus(bus)
    }

    fn news(&mut self) -> Option<News> {
        let news = self.told.dequeue();
        if news.is_some() {
            // A task may have waited for the room.
            bus::wake();
        }
        news
    }

    fn order(&mut self, order: Order) -> Result<(), Refusal> {
        order.check()?;
        self.orders.enqueue(order).map_err(|_| Refusal::Busy)?;
        bus::wake();
        Ok(())
    }

    fn lost_characters(&self) -> u32 {
        console::lost()
    }

    fn version(&self) -> &'static str {
        env!("CARGO_PKG_VERSION")
    }
}
