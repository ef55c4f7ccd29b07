//! clino: reads inclinometers over RS485 and PWM and serves their angles.
//!
//! Three levels of work, each interrupting the one below:
//!
//! 1. *Bytes* (`ports`, `uart`, `capture`, `console`, `clock`): interrupt handlers that move bytes and ticks between
//!    registers and queues, and switch the line driver.
//! 2. *Bus* (`bus`): a software interrupt that hands events and `now` to the gateway core, sends what it
//!    wants sent, publishes what it has read, and sets the alarm for the next deadline.
//! 3. *People* (this loop): prints readings when the console has room, and sleeps otherwise.
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
use clino_gateway::Reporter;
use clino_gateway::json::{self, Topic};
use cortex_m_rt::entry;
use defmt_rtt as _;
use heapless::String;
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
    let Board { console, ports, inbox, gateway, clock_source } = Board::init(peripherals, QUEUES);
    defmt::info!("clino {=str}, clock: {}", env!("CARGO_PKG_VERSION"), clock_source);
    bus::start(inbox, gateway);
    ports::start(ports, &mut core.NVIC);
    let mut printer = Printer::new(console);
    loop {
        let busy = printer.print_one();
        if !busy {
            shared::sleep_until_work();
        }
    }
}

/// Prints readings and statistics, one line at a time, as the console has room.
struct Printer {
    console: Console,
    reporter: Reporter,
    statistics: Statistics,
}

/// Every [`params::STATISTICS_EVERY`], one line for each bus and topic, between readings.
struct Statistics {
    due: Micros,
    /// Lines of this round that were printed.
    printed: usize,
}

impl Printer {
    fn new(console: Console) -> Printer {
        let statistics = Statistics { due: params::STATISTICS_EVERY, printed: 0 };
        Printer { console, reporter: Reporter::new(), statistics }
    }

    /// Prints one line if there is one to print and room for it.
    fn print_one(&mut self) -> bool {
        if !self.console.has_room() {
            return false;
        }
        let now = clock::now();
        let mut line: String<{ json::MAX_LINE }> = String::new();
        let written = match self.reporter.next(shared::reading, now) {
            Some(reading) => json::reading(&mut line, &reading, now),
            None => match self.statistics.next(now) {
                Some((topic, (bus, counters, driver))) => {
                    json::statistics(&mut line, bus, topic, &counters, &driver)
                }
                None => return false,
            },
        };
        // A line that does not fit is a mistake in `MAX_LINE`; half a line must not go out.
        if written.is_ok() {
            self.console.print(line.as_bytes());
        }
        true
    }
}

impl Statistics {
    fn next(&mut self, now: Micros) -> Option<(Topic, shared::BusStatistics)> {
        if now < self.due {
            return None;
        }
        let (bus, topic) = (self.printed / Topic::ALL.len(), self.printed % Topic::ALL.len());
        let next = Topic::ALL.get(topic).copied().zip(shared::statistics(bus));
        match next {
            Some(_) => self.printed += 1,
            None => *self = Statistics { due: self.due + params::STATISTICS_EVERY, printed: 0 },
        }
        next
    }
}
