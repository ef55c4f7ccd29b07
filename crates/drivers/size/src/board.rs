//! The board that the programs share.

use clino_drivers::uart::Nb;
use clino_drivers::{PortSettings, Rs485, Serial};
use stm32f4xx_hal::gpio::{Output, Pin};
use stm32f4xx_hal::serial::{Config, Serial as Usart};
use stm32f4xx_hal::{pac, prelude::*, rcc};

/// A line on USART1, with DE on PA8.
pub fn line(serial: Serial) -> Rs485<Nb<Usart<pac::USART1>>, Pin<'A', 8, Output>, Cycles> {
    let Some(board) = pac::Peripherals::take() else { halt() };
    let mut rcc = board.RCC.freeze(rcc::Config::hsi());
    let pins = board.GPIOA.split(&mut rcc);
    let config = Config::default().baudrate(serial.baud.bps());
    let Ok(uart) = Usart::new(board.USART1, (pins.pa9, pins.pa10), config, &mut rcc) else { halt() };
    Rs485::new(Nb::new(uart), pins.pa8.into_push_pull_output(), Cycles, PortSettings::new(serial))
}

/// A delay that counts cycles. The HAL's own, `SysDelay`, divides 64 bits by 64 bits: 0.9 KB that no driver needs.
pub struct Cycles;

/// Of the internal oscillator, which runs after a reset.
const CYCLES_PER_MICROSECOND: u32 = 16;

impl embedded_hal::delay::DelayNs for Cycles {
    fn delay_ns(&mut self, ns: u32) {
        self.delay_us(ns.div_ceil(1_000));
    }

    fn delay_us(&mut self, us: u32) {
        cortex_m::asm::delay(us.saturating_mul(CYCLES_PER_MICROSECOND));
    }
}

fn halt() -> ! {
    loop {
        cortex_m::asm::bkpt();
    }
}
