//! An ISU on an ESP32-C3, async: its LED is lit while the module is within half a degree of its null position.
//!
//! UART1 on GPIO4 (TX) and GPIO5 (RX), DE and /RE of the transceiver on GPIO6, LED on GPIO8.
#![no_std]
#![no_main]

use clino_drivers::codec::isu::Address;
use clino_drivers::uart::Io;
use clino_drivers::{PortSettings, Rs485, Serial, Timing, asynch::SttIsu};
use embassy_futures::block_on;
use embedded_hal_async::delay::DelayNs;
use esp_hal::gpio::{Level, Output, OutputConfig};
use esp_hal::timer::{OneShotTimer, timg::TimerGroup};
use esp_hal::uart::{Config, Uart};
use panic_halt as _;

esp_bootloader_esp_idf::esp_app_desc!();

#[esp_hal::main]
fn main() -> ! {
    let board = esp_hal::init(esp_hal::Config::default());
    let output = |pin| Output::new(pin, Level::Low, OutputConfig::default());
    let (de, mut led) = (output(esp_hal::gpio::AnyPin::from(board.GPIO6)), output(board.GPIO8.into()));

    let serial = Serial::ISU;
    let config = Config::default().with_baudrate(serial.baud);
    let uart = Uart::new(board.UART1, config).unwrap().with_tx(board.GPIO4).with_rx(board.GPIO5).into_async();
    let timers = TimerGroup::new(board.TIMG0);
    let delay = OneShotTimer::new(timers.timer0).into_async();

    // `flush` of this HAL waits for the last stop bit: `Release::Flushed`, the default.
    let line = Rs485::new(Io::new(uart), de, delay, PortSettings::new(serial));
    let mut isu = SttIsu::new(line, Timing::isu());
    let module = Address::new(3).unwrap();

    block_on(async {
        loop {
            match isu.angle(module).await {
                Ok(angle) if !(500..=359_500).contains(&angle.mdeg()) => led.set_high(),
                // Not level, or not known: the error says which, and what to suspect.
                _ => led.set_low(),
            }
            // The module has a new angle every 533 ms.
            isu.port().delay().delay_ms(533).await;
        }
    })
}
