//! An ISU over a UART that implements `embedded_io_async`.
//!
//! On the host, against a simulated sensor: `cargo run -p clino-drivers --features async --example isu_async`.

mod common;

use std::error::Error;

use clino_drivers::codec::isu::Address;
use clino_drivers::rs485::{PortSettings, Rs485};
use clino_drivers::uart::Io;
use clino_drivers::{Serial, Timing, asynch};
use common::{Model, executor, sensors};

/// What the simulated module is tilted by, micro-degrees.
const TILT: i64 = 347_000_000;

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    // On a microcontroller, its HAL gives the UART, the pin and the delay, and an executor runs this.
    let sensor = sensors::isu(3, TILT);
    let board = sensors::isu_board(Model::BUFFERED, &[&sensor]);
    let (uart, de, delay) = (board.uart(), board.de(), board.delay());

    let line = Rs485::new(Io::new(uart), de, delay, PortSettings::new(Serial::ISU));
    let mut isu = asynch::SttIsu::new(line, Timing::isu());

    let address = Address::new(3).ok_or("1 to 14")?;
    let angle = executor::block_on(&board, async { isu.angle(address).await })?;
    println!("{angle}°");

    if sensors::is_true(angle, TILT) { Ok(()) } else { Err(format!("the truth is {TILT} µ°").into()) }
}
