//! Cause and number of the starts, and the notes of the previous run.
//!
//! The cause comes from the reset controller (RM0090 section 7.3.21), and from notes made before the reset in memory that
//! a reset leaves alone: SRAM keeps its content for as long as it is supplied.

use core::mem::MaybeUninit;
use core::ptr;

use clino_recovery::{Crash, Journal, ResetSource, Start, TICK_MS, Uptime, WORDS};

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

/// Notes this start, after a reset for this reason. Once, before interrupts are let in.
pub fn note(reset: ResetSource) -> Start {
    let uptime = Uptime::from_words(read(ptr::addr_of!(UPTIME))).map(|uptime| uptime.0);
    let (journal, start) = Journal::begin(Journal::from_words(&read(ptr::addr_of!(JOURNAL))), reset, uptime);
    write(ptr::addr_of_mut!(JOURNAL), &journal.to_words());
    write(ptr::addr_of_mut!(UPTIME), &Uptime(0).to_words());
    Start { uid: board::uid(), ..start }
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
    board::reset()
}

/// Leaves safe mode.
#[inline(never)]
pub fn retry() -> ! {
    let mut journal = Journal::from_words(&read(ptr::addr_of!(JOURNAL))).unwrap_or_default();
    journal.retry();
    write(ptr::addr_of_mut!(JOURNAL), &journal.to_words());
    board::reset()
}

#[inline(never)]
fn read<const N: usize>(place: *const Kept<N>) -> [u32; N] {
    // SAFETY: both places are statics of this file, and any bits are numbers. A crash may interrupt a write: the checksum
    // tells.
    unsafe { ptr::read_volatile(place.cast()) }
}

fn write<const N: usize>(place: *mut Kept<N>, words: &[u32; N]) {
    // SAFETY: as above; what writes either ends in a reset, or is the start, or the tick alone.
    unsafe { ptr::write_volatile(place.cast(), *words) }
}
