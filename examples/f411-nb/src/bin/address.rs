//! A new T7, alone on the line, gets address 5 while the button is held: its LED is lit once the sensor answers there.
//!
//! USART1 on PA9 (TX) and PA10 (RX), DE and /RE of the transceiver on PA8, LED on PC13 (low: lit), button on PA0 (low: held).
#![no_std]
#![no_main]

use clino_drivers::codec::t7::{Address, Axis};
use clino_drivers::commissioning::t7::ChangeAddress;
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
    let button = pins.pa0.into_pull_up_input();
    let mut led = board.GPIOC.split(&mut rcc).pc13.into_push_pull_output();

    let serial = Serial::T7_DEFAULT;
    let config = Config::default().baudrate(serial.baud.bps());
    let uart = Usart::new(board.USART1, (pins.pa9, pins.pa10), config, &mut rcc).unwrap();
    let de = pins.pa8.into_push_pull_output();
    let delay = core.SYST.delay(&rcc.clocks);
    let line = Rs485::new(Nb::new(uart), de, delay, PortSettings::new(serial));
    let mut t7 = UsDigitalT7::new(line, Timing::t7(serial));
    let five = Address::new(5).unwrap();

    loop {
        if button.is_low() {
            // Writes to the sensor's memory, once: a second run finds it at its place, and writes nothing. One that fails says
            // why, and may be repeated.
            let change = ChangeAddress::new(Address::FACTORY, five).unwrap();
            let _ = t7.run(change);
        }
        let answers = t7.angle(five, Axis::Two).is_ok();
        led.set_state((!answers).into());
        t7.port().delay().delay_ms(100);
    }
}
