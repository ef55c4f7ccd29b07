//! What the image does on a chip that it is not made for: it says so on the console, every second, and nothing else.
//!
//! No clock is changed, no pin but the console's TX is driven, nothing is written to flash. Memory is not set up: no static is
//! used here. Every STM32F4 has what is used at the same place: GPIOA, USART2 with TX at PA2, the internal oscillator.

use stm32f4xx_hal::pac;

use super::layout::{CHIP, FLASH_KB, NAME};
use super::{FEED, tell_watchdog};
use crate::params::{CONSOLE, INTERNAL_HZ};

/// The alternate function USART2 of PA2, and its mode: two and four bits for each pin.
const TX: u32 = 2;
const ALTERNATE: u32 = 0b10;
const USART2: u32 = 7;
/// What BRR holds for the console's bit rate: sixteenths of a bit (RM0090 section 30.3.4).
const DIVIDER: u32 = (INTERNAL_HZ + CONSOLE.baud / 2) / CONSOLE.baud;
/// Between two times it waits, and feeds the watchdog so often that its shortest time at reset, 0.35 s, is long. A loop of the
/// core takes a few cycles, so all of that lasts about a second.
const PAUSES: u32 = 40;
/// Length of each, in loops.
const PAUSE: u32 = INTERNAL_HZ / 4 / PAUSES;

/// Says it for ever. `id` is the device number of the chip, `flash_kb` what flash it has.
pub extern "C" fn wrong_chip(id: u32, flash_kb: u32) -> ! {
    // SAFETY: nothing else runs.
    let (rcc, gpio, usart) = unsafe { (&*pac::RCC::ptr(), &*pac::GPIOA::ptr(), &*pac::USART2::ptr()) };
    rcc.ahb1enr().modify(|_, w| w.gpioaen().set_bit());
    rcc.apb1enr().modify(|_, w| w.usart2en().set_bit());
    // SAFETY: fields of one pin, documented in RM0090 section 8.4.
    gpio.afrl().modify(|r, w| unsafe { w.bits(r.bits() | USART2 << (4 * TX)) });
    // SAFETY: as above.
    gpio.moder().modify(|r, w| unsafe { w.bits(r.bits() | ALTERNATE << (2 * TX)) });
    // SAFETY: the register takes any 16-bit value but zero.
    usart.brr().write(|w| unsafe { w.bits(DIVIDER as u16) });
    usart.cr1().write(|w| w.ue().set_bit().te().set_bit());
    let say = |text: &str| text.bytes().for_each(|byte| send(usart, byte));
    loop {
        say("\r\nclino: this image is for an ");
        say(NAME);
        say(", ");
        say(CHIP);
        say(" with 0x");
        number(usart, FLASH_KB);
        say(" KiB of flash. This chip is device 0x");
        number(usart, id);
        say(" with 0x");
        number(usart, flash_kb);
        say(" KiB: nothing runs.\r\n");
        for _ in 0..PAUSES {
            tell_watchdog(FEED);
            cortex_m::asm::delay(PAUSE);
        }
    }
}

/// Twelve bits in hexadecimal: device numbers are written so, and it takes no division.
fn number(usart: &pac::usart1::RegisterBlock, number: u32) {
    for shift in [8, 4, 0] {
        let digit = (number >> shift) as u8 & 0xF;
        send(usart, if digit < 10 { b'0' | digit } else { b'a' - 10 + digit });
    }
}

fn send(usart: &pac::usart1::RegisterBlock, byte: u8) {
    tell_watchdog(FEED);
    while usart.sr().read().txe().bit_is_clear() {}
    usart.dr().write(|w| w.dr().set(u16::from(byte)));
}
