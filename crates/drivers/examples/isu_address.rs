//! An ISU gets another address, and a damaged EEPROM its checksum: operations of `clino-commissioning` on a driver's line.
//!
//! On the host, against a simulated sensor: `cargo run -p clino-drivers --example isu_address`.

mod common;

use std::error::Error;

use clino_drivers::codec::isu::Address;
use clino_drivers::codec::isu::eeprom::Change;
use clino_drivers::commissioning::isu::{Module, Program, Repair};
use clino_drivers::rs485::{PortSettings, Rs485};
use clino_drivers::uart::Io;
use clino_drivers::{Serial, SttIsu, Timing};
use common::{Model, sensors};

/// What the simulated module is tilted by, micro-degrees.
const TILT: i64 = 12_500_000;

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    // On a microcontroller, its HAL gives the UART, the pin and the delay.
    let sensor = sensors::isu(3, TILT);
    let board = sensors::isu_board(Model::BUFFERED, &[&sensor]);
    let (uart, de, delay) = (board.uart(), board.de(), board.delay());

    let line = Rs485::new(Io::new(uart), de, delay, PortSettings::new(Serial::ISU));
    let mut isu = SttIsu::new(line, Timing::isu());

    // Reads the EEPROM, writes word and checksum, resets the module, and looks whether it measures at the new address.
    let (three, seven) = (Address::new(3).ok_or("1 to 14")?, Address::new(7).ok_or("1 to 14")?);
    let report = isu.run(Program::new(Module::at(three)?, Change::ModuleAddress(seven))?)?;
    println!("{:?}, writes: {}", report.change, report.writes);

    // What to run after a power cut in the middle. This module is well: nothing is written.
    let repaired = isu.run(Repair::new(Module::at(seven)?))?;
    println!("checksum: {:?}, writes: {}", repaired.found, repaired.writes);

    let angle = isu.angle(seven)?;
    println!("{angle}°");
    let is_well = repaired.writes == 0 && sensors::is_true(angle, TILT);
    if is_well { Ok(()) } else { Err(format!("the truth is {TILT} µ°").into()) }
}
