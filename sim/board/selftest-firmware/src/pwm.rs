//! PWM inputs: both edges of every cycle, captured by two timers.

use stm32f4xx_hal::pac;

use crate::{put, slot};

pub fn pwm() {
    let (tim5, tim2) = unsafe { (pac::TIM5::steal(), pac::TIM2::steal()) };
    // TIM5: TI2FP2 resets the counter; channel 2 takes the rising edge directly, channel 1 the falling one.
    tim5.arr().write(|w| unsafe { w.bits(u32::MAX) });
    tim5.ccmr1_input().write(|w| unsafe { w.bits(0b01 << 8 | 0b10) });
    tim5.ccer().write(|w| unsafe { w.bits(0b0001_0011) });
    tim5.smcr().write(|w| unsafe { w.bits(0b110 << 4 | 0b100) });
    tim5.cr1().write(|w| unsafe { w.bits(1) });
    // TIM2: TI1FP1; channel 1 rising, channel 2 falling.
    tim2.arr().write(|w| unsafe { w.bits(u32::MAX) });
    tim2.ccmr1_input().write(|w| unsafe { w.bits(0b10 << 8 | 0b01) });
    tim2.ccer().write(|w| unsafe { w.bits(0b0011_0001) });
    tim2.smcr().write(|w| unsafe { w.bits(0b101 << 4 | 0b100) });
    tim2.cr1().write(|w| unsafe { w.bits(1) });

    let port = unsafe { pac::GPIOA::steal() };
    let (mut n5, mut n2, mut levels) = (0, 0, 0);
    while n5 < 9 || n2 < 9 {
        let idr = port.idr().read().bits();
        levels |= 1 << (idr >> 1 & 1) | 4 << (idr >> 15 & 1);
        if tim5.sr().read().bits() & 1 << 2 != 0 {
            let (period, high) = (tim5.ccr2().read().bits(), tim5.ccr1().read().bits());
            if (1..9).contains(&n5) {
                put(slot::PWM1 + 2 * (n5 - 1), period);
                put(slot::PWM1 + 2 * (n5 - 1) + 1, high);
            }
            n5 += 1;
        }
        if tim2.sr().read().bits() & 1 << 1 != 0 {
            let (period, high) = (tim2.ccr1().read().bits(), tim2.ccr2().read().bits());
            if (1..9).contains(&n2) {
                put(slot::PWM2 + 2 * (n2 - 1), period);
                put(slot::PWM2 + 2 * (n2 - 1) + 1, high);
            }
            n2 += 1;
        }
    }
    put(slot::PWM_LEVELS, levels);
    tim5.cr1().write(|w| unsafe { w.bits(0) });
    tim2.cr1().write(|w| unsafe { w.bits(0) });
}
