//! A USART that hears itself: **needs a wire from PC6 to PC7** (the Modbus port's TX and RX), without a transceiver.

#![no_std]
#![no_main]

#[embedded_test::tests]
mod tests {
    use stm32f4xx_hal::pac;
    use stm32f4xx_hal::prelude::*;
    use stm32f4xx_hal::rcc::Enable as _;
    use target_tests::{CORE_HZ, PERIPHERAL_HZ, cycles, start, within_us};

    /// Bits of a character, 8N1.
    const BITS: u32 = 10;
    const BAUDS: [u32; 7] = [2_400, 4_800, 9_600, 19_200, 38_400, 57_600, 115_200];
    /// PE, FE, NF, ORE.
    const ERRORS: u16 = 0b1111;

    #[init]
    fn init() -> pac::USART6 {
        let device = pac::Peripherals::take().unwrap();
        let mut rcc = start(device.RCC, &mut cortex_m::Peripherals::take().unwrap());
        let pins = device.GPIOC.split(&mut rcc);
        pins.pc6.into_alternate::<8>();
        pins.pc7.into_alternate::<8>().internal_resistor(stm32f4xx_hal::gpio::Pull::Up);
        pac::USART6::enable(&mut rcc);
        device.USART6
    }

    /// Sends a byte and returns the one heard; none in time, or with an error, is `None`.
    fn exchange(usart: &pac::USART6, byte: u8, longest_us: u32) -> Option<u8> {
        usart.dr().write(|w| w.dr().set(byte.into()));
        if !within_us(longest_us, || usart.sr().read().rxne().bit_is_set()) {
            return None;
        }
        let errors = usart.sr().read().bits() & ERRORS;
        let heard = usart.dr().read().dr().bits();
        (errors == 0).then_some(heard as u8)
    }

    #[test]
    #[timeout(30)]
    fn every_byte_comes_back_at_every_bit_rate(usart: pac::USART6) {
        for baud in BAUDS {
            let divider = (PERIPHERAL_HZ + baud / 2) / baud;
            usart.cr1().write(|w| w.ue().set_bit());
            // SAFETY: mantissa and fraction together are the divider in sixteenths, oversampling by 16.
            usart.brr().write(|w| unsafe { w.bits(divider as u16) });
            usart.cr1().write(|w| w.ue().set_bit().te().set_bit().re().set_bit());
            let character_us = 1_000_000 * (BITS + 1) / baud + 1;
            // The idle frame that TE sends first.
            within_us(2 * character_us, || false);
            for byte in 0..=u8::MAX {
                assert_eq!(exchange(&usart, byte, 3 * character_us), Some(byte), "{} bit/s", baud);
            }
        }
    }

    /// A character lasts ten bits of the divider: RXNE comes in the middle of the stop bit, TC at its end.
    #[test]
    fn a_character_lasts_as_long_as_its_divider_says(usart: pac::USART6) {
        let divider = 729;
        // SAFETY: as above; 84 MHz / 729 is 115226 bit/s.
        usart.brr().write(|w| unsafe { w.bits(divider) });
        usart.cr1().write(|w| w.ue().set_bit().te().set_bit().re().set_bit());
        assert!(within_us(1_000, || usart.sr().read().tc().bit_is_set()));
        let taken = cycles(|| {
            usart.dr().write(|w| w.dr().set(0x55));
            assert!(within_us(1_000, || usart.sr().read().tc().bit_is_set()));
        });
        let expected = u32::from(divider) * BITS * (CORE_HZ / PERIPHERAL_HZ);
        defmt::info!("a character: {} cycles, {} expected", taken, expected);
        // It begins with the next bit clock, and the loop looks every few cycles.
        assert!(taken >= expected && taken <= expected + u32::from(divider) * 2 + 100);
    }
}
