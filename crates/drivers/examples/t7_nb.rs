//! Two T7s over a UART that implements `embedded_hal_nb::serial`: the way for `stm32f4xx-hal`.
//!
//! On the host, against simulated sensors: `cargo run -p clino-drivers --example t7_nb`.

mod common;

use std::error::Error;

use clino_drivers::codec::t7::{Address, Axis};
use clino_drivers::rs485::{PortSettings, Rs485};
use clino_drivers::uart::Nb;
use clino_drivers::{Serial, Timing, UsDigitalT7};
use common::{Model, sensors};

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    // On a microcontroller, its HAL gives the UART, the pin and the delay. This UART holds one character.
    let (five, six) = (sensors::t7(5), sensors::t7(6));
    let board = sensors::t7_board(Model::BARE, &[&five, &six]);
    let (uart, de, delay) = (board.uart(), board.de(), board.delay());

    let serial = Serial::T7_DEFAULT;
    let line = Rs485::new(Nb::new(uart), de, delay, PortSettings::new(serial));
    let mut t7 = UsDigitalT7::new(line, Timing::t7(serial));

    for number in [5, 6] {
        let address = Address::new(number).ok_or("1 to 100, or 127")?;
        let angle = t7.angle(address, Axis::Two)?;
        println!("{number}: {angle}°");
        let truth = sensors::TURNING.at(board.now());
        if !sensors::is_true(angle, truth) {
            return Err(format!("the truth is {truth} µ°").into());
        }
    }
    Ok(())
}
