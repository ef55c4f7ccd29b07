//! A table of every public function of clino-codec that has code of its own.
//!
//! A pointer to a function keeps all of it in the program, whatever its callers know about its arguments. The
//! panic handler calls a function that does not exist: if any panic is left after optimisation, the program
//! does not link.

#![no_std]
#![no_main]

mod entries;

use core::panic::PanicInfo;

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
        core::hint::black_box(&entries::ENTRIES);
    }
}
