//! What all tests on the chip share: its clocks as the image sets them, and time.

#![no_std]

use cortex_m::peripheral::DWT;
use defmt_rtt as _;
use stm32f4xx_hal::pac;
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::{Config, Rcc};

/// Core clock, Hz, from a crystal of 8 MHz: as in `src/params.rs`.
pub const CORE_HZ: u32 = 168_000_000;
/// Clock of the timers on APB1 and of the USARTs on APB2, Hz.
pub const PERIPHERAL_HZ: u32 = 84_000_000;

/// The core at full speed from the crystal, with its cycles counted.
pub fn start(rcc: pac::RCC, core: &mut cortex_m::Peripherals) -> Rcc {
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
    rcc.freeze(Config::hse(8.MHz()).sysclk(CORE_HZ.Hz()))
}

/// Core cycles that something takes.
pub fn cycles(work: impl FnOnce()) -> u32 {
    let begin = DWT::cycle_count();
    work();
    DWT::cycle_count().wrapping_sub(begin)
}

/// Waits until this holds; false if it does not within that many microseconds, at most 25 s.
pub fn within_us(longest: u32, mut holds: impl FnMut() -> bool) -> bool {
    let begin = DWT::cycle_count();
    let limit = longest.saturating_mul(CORE_HZ / 1_000_000);
    while DWT::cycle_count().wrapping_sub(begin) < limit {
        if holds() {
            return true;
        }
    }
    holds()
}
