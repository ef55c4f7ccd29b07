//! Exercises what the gateway's firmware relies on and leaves the findings in `RESULTS`.
//!
//! Talks to the registers directly, so that a fault of a driver cannot be taken for one of the board. The test
//! that runs it knows the meaning of each word by `slot`.

#![no_std]
#![no_main]

mod echo;
mod it_blocks;
mod pwm;
mod reset;
mod timer;
mod usart;

use core::sync::atomic::{AtomicU32, Ordering::Relaxed};
use cortex_m_rt::entry;
use defmt_rtt as _;
use stm32f4xx_hal::pac;
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Config;

/// Where each finding is kept.
mod slot {
    pub const STAGE: usize = 0;
    pub const SYSCLK: usize = 1;
    pub const PCLK1: usize = 2;
    pub const PCLK2: usize = 3;
    /// Core cycles between two TIM4 ticks 1000 µs apart, polled.
    pub const CYCLES_PER_MS: usize = 4;
    /// Compare interrupts taken, and the largest and smallest distance from compare to handler in cycles.
    pub const COMPARES: usize = 5;
    pub const COMPARE_LATEST: usize = 6;
    pub const COMPARE_EARLIEST: usize = 7;
    /// Update interrupts taken.
    pub const UPDATES: usize = 8;
    /// Order of the nested interrupts: one hexadecimal digit per event.
    pub const NESTING: usize = 9;
    /// Counter after a WFI with interrupts masked, the compare it waited for, and handlers run meanwhile.
    pub const WOKE_AT: usize = 10;
    pub const WOKE_FOR: usize = 11;
    pub const RAN_MASKED: usize = 12;
    /// Core cycles of a sleep of 500 µs, by DWT.
    pub const SLEPT_CYCLES: usize = 13;
    /// Instructions executed in IT blocks whose condition is false, words changed on the interrupted stack, and
    /// interrupts taken meanwhile.
    pub const IT_EXECUTED: usize = 20;
    pub const IT_STACK: usize = 21;
    pub const IT_INTERRUPTS: usize = 22;
    /// USART2's SR right after the last character was written, and after TC.
    pub const CONSOLE_SR: usize = 14;
    /// Status register of USART1 after the first reply, received characters with their flags.
    pub const T7_RECEIVED: usize = 16;
    pub const T7: usize = 17;
    /// Likewise for USART3 and USART6.
    pub const ISU_RECEIVED: usize = 24;
    pub const ISU: usize = 25;
    pub const MODBUS_RECEIVED: usize = 28;
    pub const MODBUS: usize = 29;
    /// Period and pulse width of eight PWM cycles: TIM5, then TIM2.
    pub const PWM1: usize = 32;
    pub const PWM2: usize = 48;
    /// Why each of three boots happened: the top bits of RCC_CSR.
    pub const CAUSES: usize = 64;
    /// Levels read from the input register while the PWM inputs belong to the timers: bit 0 channel 1 seen low,
    /// bit 1 seen high, bits 2 and 3 likewise for channel 2.
    pub const PWM_LEVELS: usize = 67;
    pub const COUNT: usize = 68;
}

/// Not cleared at start: the findings survive the resets of the last stage. RAM is zero at power-up here.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".uninit.RESULTS")]
static RESULTS: [AtomicU32; slot::COUNT] = [const { AtomicU32::new(0) }; slot::COUNT];

fn put(slot: usize, value: u32) {
    RESULTS[slot].store(value, Relaxed);
}

fn get(slot: usize) -> u32 {
    RESULTS[slot].load(Relaxed)
}

fn add(slot: usize, value: u32) {
    put(slot, get(slot).wrapping_add(value));
}

const DONE: u32 = 0xd0e;

#[entry]
fn main() -> ! {
    let cp = cortex_m::Peripherals::take().unwrap();
    let dp = pac::Peripherals::take().unwrap();
    let rcc = dp.RCC.freeze(Config::hse(8.MHz()).sysclk(168.MHz()));
    put(slot::SYSCLK, rcc.clocks.sysclk().raw());
    put(slot::PCLK1, rcc.clocks.pclk1().raw());
    put(slot::PCLK2, rcc.clocks.pclk2().raw());
    let rcc = unsafe { pac::RCC::steal() };
    rcc.ahb1enr().modify(|r, w| unsafe { w.bits(r.bits() | 0b1111) });
    rcc.apb1enr().modify(|r, w| unsafe { w.bits(r.bits() | 0b1111 | 1 << 17 | 1 << 18) });
    rcc.apb2enr().modify(|r, w| unsafe { w.bits(r.bits() | 1 << 4 | 1 << 5) });
    let (mut dcb, mut dwt) = (cp.DCB, cp.DWT);
    dcb.enable_trace();
    dwt.enable_cycle_counter();
    let mut nvic = cp.NVIC;
    pins();

    if reset::is_under_way() {
        // Came back from a reset of the last stage.
        reset::watchdog();
    }
    put(slot::STAGE, 1);
    timer::timer(&mut nvic);
    put(slot::STAGE, 2);
    timer::nesting(&mut nvic);
    put(slot::STAGE, 3);
    timer::masked_sleep();
    it_blocks::it_blocks();
    put(slot::STAGE, 4);
    usart::console();
    put(slot::STAGE, 5);
    usart::t7(&mut nvic);
    put(slot::STAGE, 6);
    usart::others();
    put(slot::STAGE, 7);
    pwm::pwm();
    put(slot::STAGE, 8);
    for i in 0..200_u32 {
        defmt::println!("a line that fills the log: {=u32} {=u32}", i, !i);
        timer::wait_us(100);
    }
    reset::watchdog()
}

/// Switches `pin` of the port to `mode`: 1 output, or an alternate function + 16.
fn pin(port: *const pac::gpioa::RegisterBlock, pin: u32, mode: u32) {
    let port = unsafe { &*port };
    let (two, bits) = (2 * pin, if mode < 16 { mode } else { 2 });
    port.moder().modify(|r, w| unsafe { w.bits(r.bits() & !(3 << two) | bits << two) });
    if mode >= 16 {
        let four = 4 * (pin % 8);
        let set = |old: u32| old & !(0xf << four) | (mode - 16) << four;
        if pin < 8 {
            port.afrl().modify(|r, w| unsafe { w.bits(set(r.bits())) });
        } else {
            port.afrh().modify(|r, w| unsafe { w.bits(set(r.bits())) });
        }
    }
}

fn pins() {
    let (a, b) = (pac::GPIOA::ptr().cast(), pac::GPIOB::ptr().cast());
    let (c, d) = (pac::GPIOC::ptr().cast(), pac::GPIOD::ptr().cast());
    for (port, number, mode) in [
        (a, 1, 16 + 2),
        (a, 15, 16 + 1),
        (a, 2, 16 + 7),
        (a, 3, 16 + 7),
        (b, 6, 16 + 7),
        (b, 7, 16 + 7),
        (b, 8, 1),
        (d, 8, 16 + 7),
        (d, 9, 16 + 7),
        (d, 10, 1),
        (c, 6, 16 + 8),
        (c, 7, 16 + 8),
        (c, 8, 1),
    ] {
        pin(port, number, mode);
    }
}

#[panic_handler]
fn panic(_info: &core::panic::PanicInfo<'_>) -> ! {
    cortex_m::asm::udf()
}
