//! A T7 on an STM32F411 ("Black Pill"), async: its LED is lit while axis 2 is within half a degree of level.
//!
//! USART1 on PA9 (TX) and PA10 (RX), DE and /RE of the transceiver on PA8, LED on PC13 (low: lit).
#![no_std]
#![no_main]

use clino_drivers::codec::t7::{Address, Axis};
use clino_drivers::uart::Io;
use clino_drivers::{PortSettings, Rs485, Serial, Timing, asynch::UsDigitalT7};
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::peripherals::USART1;
use embassy_stm32::usart::{BufferedInterruptHandler, BufferedUart, Config};
use embassy_time::{Delay, Timer};
use panic_halt as _;

embassy_stm32::bind_interrupts!(struct Interrupts {
    USART1 => BufferedInterruptHandler<USART1>;
});

#[embassy_executor::main]
async fn main(_spawner: embassy_executor::Spawner) {
    let board = embassy_stm32::init(Default::default());
    let mut led = Output::new(board.PC13, Level::High, Speed::Low);
    let de = Output::new(board.PA8, Level::Low, Speed::Low);

    let serial = Serial::T7_DEFAULT;
    let (mut transmit, mut receive) = ([0; 64], [0; 64]);
    let mut config = Config::default();
    config.baudrate = serial.baud;
    // Else a reader is woken when the buffer is half full, or after a character of silence.
    config.eager_reads = Some(1);
    let (rx, tx) = (board.PA10, board.PA9);
    let uart =
        BufferedUart::new(board.USART1, rx, tx, &mut transmit, &mut receive, Interrupts, config).unwrap();

    // `flush` of this HAL waits for the last stop bit: `Release::Flushed`, the default.
    let line = Rs485::new(Io::new(uart), de, Delay, PortSettings::new(serial));
    let mut t7 = UsDigitalT7::new(line, Timing::t7(serial));
    let sensor = Address::FACTORY;

    loop {
        match t7.angle(sensor, Axis::Two).await {
            Ok(angle) if angle.mdeg().abs() < 500 => led.set_low(),
            // Not level, or not known: the error says which, and what to suspect.
            _ => led.set_high(),
        }
        Timer::after_millis(100).await;
    }
}
