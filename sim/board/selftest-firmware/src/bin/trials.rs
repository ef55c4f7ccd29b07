//! Tries one thing that ends, or may end, in a reset: the watchdog, or a crystal that stops.
//!
//! What is tried stands in the first words of sector 1 (the test puts it there); what was found is left in `RESULTS`,
//! which resets leave alone. Talks to the registers directly.

#![no_std]
#![no_main]

use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

use cortex_m::peripheral::DWT;
use cortex_m_rt::{entry, exception};
use defmt_rtt as _;
use stm32f4xx_hal::pac;
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Config;

/// Where the order stands: the trial and up to four numbers.
const ORDER: *const u32 = 0x0800_4000 as *const u32;

/// Starts, trials that came to their end, NMIs, RCC_CR and RCC_CFGR before the crystal stops and in the last NMI, the
/// causes in RCC_CSR at the last start, and turns of the counting loop of 160 000 cycles.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".uninit.RESULTS")]
static RESULTS: [AtomicU32; 8] = [const { AtomicU32::new(0) }; 8];

const STARTS: usize = 0;
const ENDED: usize = 1;
const NMIS: usize = 2;
const CR: usize = 3;
const CFGR: usize = 4;
const CAUSE: usize = 5;
const ROUNDS: usize = 6;

fn put(slot: usize, value: u32) {
    RESULTS[slot].store(value, Relaxed);
}

fn add(slot: usize) {
    put(slot, RESULTS[slot].load(Relaxed).wrapping_add(1));
}

fn order(word: usize) -> u32 {
    unsafe { ORDER.add(word).read_volatile() }
}

#[entry]
fn main() -> ! {
    let mut cp = cortex_m::Peripherals::take().unwrap();
    cp.DCB.enable_trace();
    cp.DWT.enable_cycle_counter();
    let rcc = unsafe { pac::RCC::steal() };
    put(CAUSE, rcc.csr().read().bits() >> 25);
    rcc.csr().modify(|r, w| unsafe { w.bits(r.bits() | 1 << 24) });
    add(STARTS);
    if order(0) == 4 {
        registers();
    }
    if RESULTS[STARTS].load(Relaxed) == 1 {
        match order(0) {
            1 => starve(),
            2 => erase(),
            3 => crystal(),
            _ => {}
        }
    }
    loop {
        cortex_m::asm::wfi();
    }
}

/// Waits; the core runs on the internal oscillator, 16 MHz.
fn wait_us(us: u32) {
    let begin = DWT::cycle_count();
    while DWT::cycle_count().wrapping_sub(begin) < 16 * us {}
}

/// Starts the watchdog.
fn watchdog(prescaler: u32, reload: u32) -> pac::IWDG {
    let iwdg = unsafe { pac::IWDG::steal() };
    iwdg.kr().write(|w| unsafe { w.bits(0xcccc) });
    iwdg.kr().write(|w| unsafe { w.bits(0x5555) });
    iwdg.pr().write(|w| unsafe { w.bits(prescaler as u16) });
    iwdg.rlr().write(|w| unsafe { w.bits(reload as u16) });
    while iwdg.sr().read().bits() != 0 {}
    feed(&iwdg);
    iwdg
}

fn feed(iwdg: &pac::IWDG) {
    iwdg.kr().write(|w| unsafe { w.bits(0xaaaa) });
}

/// Prescaler and reload value of the watchdog are words 1 and 2. Feeds it as often as word 3 says, 100 ms apart, and then
/// no more.
fn starve() {
    let iwdg = watchdog(order(1), order(2));
    for _ in 0..order(3) {
        wait_us(100_000);
        feed(&iwdg);
    }
    add(ENDED);
}

/// Erases sector 2 under the watchdog of words 1 and 2.
fn erase() {
    let iwdg = watchdog(order(1), order(2));
    let flash = unsafe { pac::FLASH::steal() };
    flash.keyr().write(|w| unsafe { w.bits(0x4567_0123) });
    flash.keyr().write(|w| unsafe { w.bits(0xcdef_89ab) });
    feed(&iwdg);
    // SER, SNB = 2, PSIZE = 32 bits, STRT.
    flash.cr().write(|w| unsafe { w.bits(1 << 1 | 2 << 3 | 2 << 8 | 1 << 16) });
    while flash.sr().read().bits() & 1 << 16 != 0 {}
    feed(&iwdg);
    add(ENDED);
}

/// Runs on the crystal at 168 MHz, and counts; with the clock security system if word 1 says so, otherwise with the
/// watchdog started at 32 times 400 periods.
fn crystal() {
    let dp = unsafe { pac::Peripherals::steal() };
    let _ = dp.RCC.freeze(Config::hse(8.MHz()).sysclk(168.MHz()));
    let rcc = unsafe { pac::RCC::steal() };
    if order(1) != 0 {
        rcc.cr().modify(|r, w| unsafe { w.bits(r.bits() | 1 << 19) });
    } else {
        watchdog(3, 399);
    }
    put(CR, rcc.cr().read().bits());
    put(CFGR, rcc.cfgr().read().bits());
    loop {
        let begin = DWT::cycle_count();
        while DWT::cycle_count().wrapping_sub(begin) < 160_000 {}
        add(ROUNDS);
    }
}

/// Switches the peripherals' clocks on, so that their registers can be looked at. At the first start it then changes all that
/// can be changed, and lets the watchdog end it.
fn registers() {
    let dp = unsafe { pac::Peripherals::steal() };
    dp.RCC.ahb1enr().modify(|r, w| unsafe { w.bits(r.bits() | 0xf) });
    dp.RCC.apb1enr().write(|w| unsafe { w.bits(1 << 28 | 0x0006_000d) });
    dp.RCC.apb2enr().write(|w| unsafe { w.bits(1 << 14 | 0x30) });
    if RESULTS[STARTS].load(Relaxed) > 1 {
        return;
    }
    wait_us(20_000);
    for gpio in [0x4002_0000, 0x4002_0400, 0x4002_0800, 0x4002_0c00] {
        // MODER, OTYPER, OSPEEDR, PUPDR, ODR, AFRL, AFRH.
        for offset in [0x00, 0x04, 0x08, 0x0c, 0x14, 0x20, 0x24] {
            change(gpio + offset);
        }
    }
    for usart in [0x4001_1000, 0x4000_4400, 0x4000_4800, 0x4001_1400] {
        // BRR, CR1, CR2, CR3, GTPR.
        for offset in [0x08, 0x0c, 0x10, 0x14, 0x18] {
            change(usart + offset);
        }
    }
    for timer in [0x4000_0000, 0x4000_0800, 0x4000_0c00] {
        // SMCR, CCMR1, CCMR2, PSC, ARR, CCR1.
        for offset in [0x08, 0x18, 0x1c, 0x28, 0x2c, 0x34] {
            change(timer + offset);
        }
    }
    // EXTI: IMR, EMR, RTSR, FTSR. SYSCFG: EXTICR1.
    for register in [0x4001_3c00, 0x4001_3c04, 0x4001_3c08, 0x4001_3c0c, 0x4001_3808] {
        change(register);
    }
    watchdog(3, 399);
}

/// Inverts what can be inverted.
fn change(register: usize) {
    let register = register as *mut u32;
    unsafe { register.write_volatile(!register.read_volatile() & 0x5555_5555) };
}

/// Only the clock security system raises it.
#[exception]
unsafe fn NonMaskableInt() {
    let rcc = unsafe { pac::RCC::steal() };
    put(CR, rcc.cr().read().bits());
    put(CFGR, rcc.cfgr().read().bits());
    // CSSF is set; CSSC clears it.
    if rcc.cir().read().bits() & 1 << 7 != 0 {
        rcc.cir().write(|w| unsafe { w.bits(1 << 23) });
        add(NMIS);
    }
}

#[panic_handler]
fn panic(_info: &core::panic::PanicInfo<'_>) -> ! {
    cortex_m::asm::udf()
}
