//! Why and how often the board has started.
//!
//! The cause is what the reset controller says (RM0090 section 7.3.21). Starts are counted in memory that a reset leaves
//! alone; a copy with every bit turned tells whether it is that, or what was there when the power came.

use core::cell::Cell;
use core::mem::MaybeUninit;
use core::ptr;

use clino_recovery::{Reset, Start};
use critical_section::Mutex;
use stm32f4xx_hal::pac;

#[unsafe(link_section = ".uninit.starts")]
static mut STARTS: MaybeUninit<[u32; 2]> = MaybeUninit::uninit();

static START: Mutex<Cell<Option<Start>>> = Mutex::new(Cell::new(None));

/// Why the board has started; unknown before [`note`].
pub fn start() -> Start {
    critical_section::with(|cs| START.borrow(cs).get()).unwrap_or_default()
}

/// Notes this start. Once, before interrupts are let in.
pub fn note(rcc: &pac::RCC) {
    let flags = rcc.csr().read();
    // Each reset sets the flag of the pin, too, and each power-on that of the brown-out detector.
    let reset = if flags.porrstf().bit_is_set() {
        Reset::PowerOn
    } else if flags.borrstf().bit_is_set() {
        Reset::BrownOut
    } else if flags.wdgrstf().bit_is_set() {
        Reset::Watchdog
    } else if flags.wwdgrstf().bit_is_set() {
        Reset::WindowWatchdog
    } else if flags.sftrstf().bit_is_set() {
        Reset::Software
    } else if flags.lpwrrstf().bit_is_set() {
        Reset::LowPower
    } else if flags.padrstf().bit_is_set() {
        Reset::Pin
    } else {
        Reset::Unknown
    };
    rcc.csr().modify(|_, w| w.rmvf().set_bit());
    let boots = count(reset == Reset::PowerOn);
    critical_section::with(|cs| {
        START.borrow(cs).set(Some(Start { cause: reset.into(), boots, ..Start::default() }))
    });
}

fn count(first: bool) -> u32 {
    let place = ptr::addr_of_mut!(STARTS).cast::<[u32; 2]>();
    // SAFETY: only this function touches it, once a start and before any interrupt; any bits are two numbers.
    let [count, turned] = unsafe { ptr::read_volatile(place) };
    let count = if first || turned != !count { 1 } else { count.wrapping_add(1) };
    // SAFETY: as above.
    unsafe { ptr::write_volatile(place, [count, !count]) };
    count
}
