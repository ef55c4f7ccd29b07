//! A T7 on a Raspberry Pi Pico, async: its LED is lit while axis 2 is within half a degree of level.
//!
//! UART0 on GPIO0 (TX) and GPIO1 (RX), DE and /RE of the transceiver on GPIO2, LED on GPIO25.
#![no_std]
#![no_main]

use clino_drivers::codec::t7::{Address, Axis};
use clino_drivers::rs485::Release;
use clino_drivers::uart::Io;
use clino_drivers::{PortSettings, Rs485, Serial, Timing, asynch::UsDigitalT7};
use embassy_rp::gpio::{Level, Output};
use embassy_rp::peripherals::UART0;
use embassy_rp::uart::{BufferedInterruptHandler, BufferedUart, Config};
use embassy_time::{Delay, Timer};
use panic_halt as _;

embassy_rp::bind_interrupts!(struct Interrupts {
    UART0_IRQ => BufferedInterruptHandler<UART0>;
});

#[embassy_executor::main]
async fn main(_spawner: embassy_executor::Spawner) {
    let board = embassy_rp::init(Default::default());
    let mut led = Output::new(board.PIN_25, Level::Low);
    let de = Output::new(board.PIN_2, Level::Low);

    let serial = Serial::T7_DEFAULT;
    let (mut transmit, mut receive) = ([0; 64], [0; 64]);
    let mut config = Config::default();
    config.baudrate = serial.baud;
    let (tx, rx) = (board.PIN_0, board.PIN_1);
    let uart = BufferedUart::new(board.UART0, tx, rx, Interrupts, &mut transmit, &mut receive, config);

    // `flush` of this HAL returns while the whole frame is in the FIFO, and its receiver waits for 28 of 32 characters or
    // for silence.
    let settings = PortSettings { release: Release::WHOLE_FRAME, ..PortSettings::new(serial) };
    let timing = Timing::t7(serial).handed_over_within(serial.characters(32));
    let mut t7 = UsDigitalT7::new(Rs485::new(Io::new(uart), de, Delay, settings), timing);
    let sensor = Address::FACTORY;

    loop {
        match t7.angle(sensor, Axis::Two).await {
            Ok(angle) if angle.mdeg().abs() < 500 => led.set_high(),
            // Not level, or not known: the error says which, and what to suspect.
            _ => led.set_low(),
        }
        Timer::after_millis(100).await;
    }
}
