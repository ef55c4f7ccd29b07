//! A T7 on a Raspberry Pi Pico, blocking: its LED is lit while axis 2 is within half a degree of level.
//!
//! UART0 on GPIO0 (TX) and GPIO1 (RX), DE and /RE of the transceiver on GPIO2, LED on GPIO25.
#![no_std]
#![no_main]

use clino_drivers::codec::t7::{Address, Axis};
use clino_drivers::rs485::Release;
use clino_drivers::uart::Nb;
use clino_drivers::{PortSettings, Rs485, Serial, Timing, UsDigitalT7};
use embassy_rp::gpio::{Level, Output};
use embassy_rp::uart::{Config, Uart};
use embassy_time::{Delay, Duration, block_for};
use panic_halt as _;

#[cortex_m_rt::entry]
fn main() -> ! {
    let board = embassy_rp::init(Default::default());
    let mut led = Output::new(board.PIN_25, Level::Low);
    let de = Output::new(board.PIN_2, Level::Low);

    let serial = Serial::T7_DEFAULT;
    let mut config = Config::default();
    config.baudrate = serial.baud;
    let uart = Uart::new_blocking(board.UART0, board.PIN_0, board.PIN_1, config);

    // `flush` of this HAL returns when the last character has left the FIFO: it is still being sent.
    let settings = PortSettings { release: Release::TRANSMIT_REGISTER_EMPTY, ..PortSettings::new(serial) };
    let mut t7 = UsDigitalT7::new(Rs485::new(Nb::new(uart), de, Delay, settings), Timing::t7(serial));
    let sensor = Address::FACTORY;

    loop {
        match t7.angle(sensor, Axis::Two) {
            Ok(angle) if angle.mdeg().abs() < 500 => led.set_high(),
            // Not level, or not known: the error says which, and what to suspect.
            _ => led.set_low(),
        }
        block_for(Duration::from_millis(100));
    }
}
