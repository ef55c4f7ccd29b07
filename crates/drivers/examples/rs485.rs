//! The line without a sensor driver, for any half-duplex protocol: a frame goes out through `embedded_io::Write`, the
//! answer is read through `embedded_io::Read`. Here the frames are a T7's, written by hand.
//!
//! On the host, against a simulated sensor: `cargo run -p clino-drivers --example rs485`.

mod common;

use std::error::Error;

use clino_drivers::Serial;
use clino_drivers::codec::angle::Angle;
use clino_drivers::rs485::{PortSettings, Rs485};
use clino_drivers::uart::Io;
use common::{Model, sensors};
use embedded_io::{Read, Write};

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    // On a microcontroller, its HAL gives the UART, the pin and the delay.
    let sensor = sensors::t7(5);
    let board = sensors::t7_board(Model::BUFFERED, &[&sensor]);
    let (uart, de, delay) = (board.uart(), board.de(), board.delay());

    let mut line = Rs485::new(Io::new(uart), de, delay, PortSettings::new(Serial::T7_DEFAULT));

    // Device 5, one byte follows, get the angle of axis 2.
    line.write_all(&[0x05, 0x01, 0x83])?;
    let mut answer = [0; 8];
    line.read_exact(&mut answer)?;
    println!("{answer:02X?}");

    let [0x05, 0x06, 0x83, a, b, c, d, _checksum] = answer else { return Err("no such answer".into()) };
    let angle = Angle::from_mdeg(i32::from_be_bytes([a, b, c, d])).ok_or("out of range")?;
    println!("{angle}°");

    let truth = sensors::TURNING.at(board.now());
    if sensors::is_true(angle, truth) { Ok(()) } else { Err(format!("the truth is {truth} µ°").into()) }
}
