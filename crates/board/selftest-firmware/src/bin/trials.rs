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
