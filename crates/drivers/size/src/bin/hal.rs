//! The HAL alone: what a program has that sends three characters and reads eight, with no driver.
#![no_std]
#![no_main]

#[path = "../board.rs"]
mod board;

use clino_drivers::Serial;
use embedded_hal::delay::DelayNs;
use embedded_hal_nb::serial::{Read, Write};
use panic_halt as _;

#[cortex_m_rt::entry]
fn main() -> ! {
    let (uart, mut de, mut delay) = board::line(Serial::T7_DEFAULT).release();
    let mut uart = uart.release();
    loop {
        _ = de.set_high();
        for byte in [127, 1, 0x83] {
            while uart.write(byte).is_err() {}
        }
        while uart.flush().is_err() {}
        _ = de.set_low();
        for _ in 0..8 {
            while uart.read().map(|byte| core::hint::black_box(byte)).is_err() {
                delay.delay_us(10);
            }
        }
    }
}
