//! A T7 on an STM32F411 ("Black Pill"), blocking: its LED is lit while axis 2 is within half a degree of level.
//!
//! USART1 on PA9 (TX) and PA10 (RX), DE and /RE of the transceiver on PA8, LED on PC13 (low: lit).
#![no_std]
#![no_main]

use clino_drivers::codec::t7::{Address, Axis};
use clino_drivers::uart::Nb;
use clino_drivers::{PortSettings, Rs485, Serial, Timing, UsDigitalT7};
use panic_halt as _;
use stm32f4xx_hal::serial::{Config, Serial as Usart};
use stm32f4xx_hal::{pac, prelude::*, rcc};

#[cortex_m_rt::entry]
fn main() -> ! {
    let board = pac::Peripherals::take().unwrap();
    let core = cortex_m::Peripherals::take().unwrap();
    let mut rcc = board.RCC.freeze(rcc::Config::hsi().sysclk(84.MHz()));
    let pins = board.GPIOA.split(&mut rcc);
    let mut led = board.GPIOC.split(&mut rcc).pc13.into_push_pull_output();

    let serial = Serial::T7_DEFAULT;
    let config = Config::default().baudrate(serial.baud.bps());
    let uart = Usart::new(board.USART1, (pins.pa9, pins.pa10), config, &mut rcc).unwrap();
    let de = pins.pa8.into_push_pull_output();
    let delay = core.SYST.delay(&rcc.clocks);

    // `flush` of this HAL waits for the last stop bit: `Release::Flushed`, the default.
    let line = Rs485::new(Nb::new(uart), de, delay, PortSettings::new(serial));
    let mut t7 = UsDigitalT7::new(line, Timing::t7(serial));
    let sensor = Address::FACTORY;

    loop {
        match t7.angle(sensor, Axis::Two) {
            Ok(angle) if angle.mdeg().abs() < 500 => led.set_low(),
            // Not level, or not known: the error says which, and what to suspect.
            _ => led.set_high(),
        }
        t7.port().delay().delay_ms(100);
    }
}
