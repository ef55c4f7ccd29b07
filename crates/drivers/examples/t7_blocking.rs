//! A T7 over a UART that implements `embedded_io`, blocking.
//!
//! On the host, against a simulated sensor: `cargo run -p clino-drivers --example t7_blocking`.

mod common;

use std::error::Error;

use clino_drivers::codec::t7::{Address, Axis};
use clino_drivers::rs485::{PortSettings, Rs485};
use clino_drivers::uart::Io;
use clino_drivers::{Serial, Timing, UsDigitalT7};
use common::{Model, sensors};

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    // On a microcontroller, its HAL gives the UART, the pin and the delay.
    let sensor = sensors::t7(5);
    let board = sensors::t7_board(Model::BUFFERED, &[&sensor]);
    let (uart, de, delay) = (board.uart(), board.de(), board.delay());

    let serial = Serial::T7_DEFAULT;
    let line = Rs485::new(Io::new(uart), de, delay, PortSettings::new(serial));
    let mut t7 = UsDigitalT7::new(line, Timing::t7(serial));

    let address = Address::new(5).ok_or("1 to 100, or 127")?;
    let information = t7.information(address)?;
    println!("serial number {}, firmware {:?}", information.serial, information.firmware.as_str());
    let angle = t7.angle(address, Axis::Two)?;
    println!("{angle}°");

    let truth = sensors::TURNING.at(board.now());
    if sensors::is_true(angle, truth) { Ok(()) } else { Err(format!("the truth is {truth} µ°").into()) }
}
