//! An ISU on a Raspberry Pi Pico, blocking: its LED is lit while the module is within half a degree of its null position.
//!
//! UART0 on GPIO0 (TX) and GPIO1 (RX), DE and /RE of the transceiver on GPIO2, LED on GPIO25.
#![no_std]
#![no_main]

use clino_drivers::codec::isu::Address;
use clino_drivers::uart::Nb;
use clino_drivers::{PortSettings, Rs485, Serial, SttIsu, Timing};
use embedded_hal::{delay::DelayNs, digital::OutputPin};
use panic_halt as _;
use rp2040_hal::uart::{DataBits, StopBits, UartConfig, UartPeripheral};
use rp2040_hal::{
    Clock, Sio, Timer, Watchdog, clocks::init_clocks_and_plls, fugit::RateExtU32, gpio::Pins, pac,
};

#[unsafe(link_section = ".boot2")]
#[used]
static BOOT2: [u8; 256] = rp2040_boot2::BOOT_LOADER_GENERIC_03H;

const CRYSTAL_HZ: u32 = 12_000_000;

#[rp2040_hal::entry]
fn main() -> ! {
    let board = pac::Peripherals::take().unwrap();
    let (mut resets, mut watchdog) = (board.RESETS, Watchdog::new(board.WATCHDOG));
    let (crystal, sys, usb) = (board.XOSC, board.PLL_SYS, board.PLL_USB);
    let clocks =
        init_clocks_and_plls(CRYSTAL_HZ, crystal, board.CLOCKS, sys, usb, &mut resets, &mut watchdog)
            .ok()
            .unwrap();
    let pins = Pins::new(board.IO_BANK0, board.PADS_BANK0, Sio::new(board.SIO).gpio_bank0, &mut resets);
    let mut led = pins.gpio25.into_push_pull_output();
    let de = pins.gpio2.into_push_pull_output();

    let serial = Serial::ISU;
    let config = UartConfig::new(serial.baud.Hz(), DataBits::Eight, None, StopBits::One);
    let lines = (pins.gpio0.into_function(), pins.gpio1.into_function());
    let uart = UartPeripheral::new(board.UART0, lines, &mut resets);
    let uart = uart.enable(config, clocks.peripheral_clock.freq()).unwrap();
    let timer = Timer::new(board.TIMER, &mut resets, &clocks);

    // `flush` of this HAL waits for the last stop bit: `Release::Flushed`, the default.
    let line = Rs485::new(Nb::new(uart), de, timer, PortSettings::new(serial));
    let mut isu = SttIsu::new(line, Timing::isu());
    let module = Address::new(3).unwrap();

    loop {
        // Not near it, or not known: the error says which, and what to suspect.
        let is_near = isu.angle(module).is_ok_and(|angle| !(500..=359_500).contains(&angle.mdeg()));
        led.set_state(is_near.into()).unwrap();
        // The module has a new angle every 533 ms.
        isu.port().delay().delay_ms(533);
    }
}
