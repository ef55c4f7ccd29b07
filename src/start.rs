//! Why and how often the board has started, and what the time before has left.
//!
//! The cause is what the reset controller says (RM0090 section 7.3.21), and what was noted before the reset in memory that
//! a reset leaves alone: SRAM keeps what is in it for as long as it is supplied.

use core::cell::Cell;
use core::mem::MaybeUninit;
use core::ptr;

use clino_recovery::{Clock, Crash, Journal, ResetSource, Start, TICK_MS, Uid, Uptime, WORDS};
use cortex_m::peripheral::SCB;
use critical_section::Mutex;
use stm32f4xx_hal::pac;

use crate::board;

/// Words that outlive a reset. In `.uninit`, which the start-up code leaves alone.
#[repr(transparent)]
struct Kept<const N: usize>(MaybeUninit<[u32; N]>);

impl<const N: usize> Kept<N> {
    const fn new() -> Self {
        Kept(MaybeUninit::uninit())
    }
}

#[unsafe(link_section = ".uninit.journal")]
static mut JOURNAL: Kept<WORDS> = Kept::new();
#[unsafe(link_section = ".uninit.uptime")]
static mut UPTIME: Kept<2> = Kept::new();

static START: Mutex<Cell<Start>> = Mutex::new(Cell::new(Start {
    cause: clino_recovery::StartCause::Unknown,
    boots: 0,
    crashes: 0,
    mode: clino_recovery::Mode::Normal,
    clock: Clock::Crystal,
    crash: None,
    uid: Uid([0; 3]),
}));

/// Why, how often and how the board has started.
pub fn start() -> Start {
    critical_section::with(|cs| START.borrow(cs).get())
}

/// Notes this start. Once, before interrupts are let in.
pub fn note(rcc: &pac::RCC) -> Start {
    let reset = reset(rcc);
    let uptime = Uptime::from_words(read(ptr::addr_of!(UPTIME))).map(|uptime| uptime.0);
    let (journal, start) = Journal::begin(Journal::from_words(&read(ptr::addr_of!(JOURNAL))), reset, uptime);
    let start = Start { uid: board::uid(), ..start };
    write(ptr::addr_of_mut!(JOURNAL), &journal.to_words());
    write(ptr::addr_of_mut!(UPTIME), &Uptime(0).to_words());
    critical_section::with(|cs| START.borrow(cs).set(start));
    start
}

/// What time is measured with turned out to be this.
pub fn note_clock(clock: Clock) {
    critical_section::with(|cs| START.borrow(cs).set(Start { clock, ..START.borrow(cs).get() }));
}

/// What the reset controller says; it is told to forget it.
fn reset(rcc: &pac::RCC) -> ResetSource {
    let flags = rcc.csr().read();
    rcc.csr().modify(|_, w| w.rmvf().set_bit());
    // Each reset sets the flag of the pin, too, and each power-on that of the brown-out detector.
    if flags.porrstf().bit_is_set() {
        ResetSource::PowerOn
    } else if flags.borrstf().bit_is_set() {
        ResetSource::BrownOut
    } else if flags.wdgrstf().bit_is_set() {
        ResetSource::Watchdog
    } else if flags.wwdgrstf().bit_is_set() {
        ResetSource::WindowWatchdog
    } else if flags.sftrstf().bit_is_set() {
        ResetSource::Software
    } else if flags.lpwrrstf().bit_is_set() {
        ResetSource::LowPower
    } else if flags.padrstf().bit_is_set() {
        ResetSource::Pin
    } else {
        ResetSource::Unknown
    }
}

/// A tick of the watchdog has passed since the start. For that tick only.
pub fn keep_uptime() {
    let uptime = Uptime::from_words(read(ptr::addr_of!(UPTIME))).map_or(0, |uptime| uptime.0);
    write(ptr::addr_of_mut!(UPTIME), &Uptime(uptime.saturating_add(TICK_MS)).to_words());
}

/// Notes a crash for the next start, which is now. May be called from anywhere, and at any time.
#[inline(never)]
pub fn crash(crash: &Crash) -> ! {
    let uptime = Uptime::from_words(read(ptr::addr_of!(UPTIME))).map_or(0, |uptime| uptime.0);
    let mut words = read(ptr::addr_of!(JOURNAL));
    Journal::note(&mut words, crash, uptime);
    write(ptr::addr_of_mut!(JOURNAL), &words);
    SCB::sys_reset()
}

/// Leaves safe mode.
#[inline(never)]
pub fn retry() -> ! {
    let mut journal = Journal::from_words(&read(ptr::addr_of!(JOURNAL))).unwrap_or_default();
    journal.retry();
    write(ptr::addr_of_mut!(JOURNAL), &journal.to_words());
    SCB::sys_reset()
}

fn read<const N: usize>(place: *const Kept<N>) -> [u32; N] {
    // SAFETY: both places are statics of this file, and any bits are numbers. A crash may interrupt a write: the checksum
    // tells.
    unsafe { ptr::read_volatile(place.cast()) }
}

fn write<const N: usize>(place: *mut Kept<N>, words: &[u32; N]) {
    // SAFETY: as above; what writes either ends in a reset, or is the start, or the tick alone.
    unsafe { ptr::write_volatile(place.cast(), *words) }
}
