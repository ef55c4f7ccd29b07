//! A table of every public function of clino-bus and clino-gateway that has code of its own.
//!
//! A pointer to a function keeps all of it in the program, whatever its callers know about its arguments. The
//! panic handler calls a function that does not exist: if any panic is left after optimisation, the program
//! does not link. What these crates use of others (codec, commissioning, heapless) is in it as far as they use it.
//!
//! Not in it: what writes text (`json`, `Display`), for the formatting of the standard library has panics of its own.

#![no_std]
#![no_main]

mod bus;
mod gateway;

use core::panic::PanicInfo;

/// Address of a function.
pub struct Entry(#[expect(dead_code, reason = "the pointer is only stored")] *const ());

// SAFETY: the pointer is only stored, never called or dereferenced.
unsafe impl Sync for Entry {}

macro_rules! entries {
    ($($function:expr),* $(,)?) => {
        [$($crate::Entry($function as *const ())),*]
    };
}
pub(crate) use entries;

unsafe extern "C" {
    /// Defined nowhere.
    fn a_panic_is_reachable() -> !;
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    // SAFETY: never runs, because it never links.
    unsafe { a_panic_is_reachable() }
}

/// Where the program starts.
#[unsafe(no_mangle)]
pub extern "C" fn _start() -> ! {
    loop {
        core::hint::black_box((bus::ENTRIES, bus::T7_ENTRIES, bus::ISU_ENTRIES, gateway::ENTRIES));
    }
}
