//! A T7 gets an address of its own: an operation of `clino-commissioning` on a driver's line.
//!
//! On the host, against a simulated sensor: `cargo run -p clino-drivers --example t7_address`.

mod common;

use std::error::Error;

use clino_drivers::codec::t7::{Address, Axis};
use clino_drivers::commissioning::t7::ChangeAddress;
use clino_drivers::rs485::{PortSettings, Rs485};
use clino_drivers::uart::Io;
use clino_drivers::{Serial, Timing, UsDigitalT7};
use common::{Model, sensors};

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    // On a microcontroller, its HAL gives the UART, the pin and the delay.
    let sensor = sensors::t7(Address::FACTORY.get());
    let board = sensors::t7_board(Model::BUFFERED, &[&sensor]);
    let (uart, de, delay) = (board.uart(), board.de(), board.delay());

    let serial = Serial::T7_DEFAULT;
    let line = Rs485::new(Io::new(uart), de, delay, PortSettings::new(serial));
    let mut t7 = UsDigitalT7::new(line, Timing::t7(serial));

    // Looks whether the new address is free, writes, and finds the device there. Run again after a power cut, it goes on.
    let five = Address::new(5).ok_or("1 to 100, or 127")?;
    let report = t7.run(ChangeAddress::new(Address::FACTORY, five)?)?;
    println!("{:?}, writes: {}", report.change, report.writes);
    let angle = t7.angle(five, Axis::Two)?;
    println!("{angle}°");

    let kept = sensor.lock().map_err(|_| "the simulated sensor panicked")?.settings().address;
    if kept == 5 && report.writes == 1 { Ok(()) } else { Err(format!("its address is {kept}").into()) }
}
