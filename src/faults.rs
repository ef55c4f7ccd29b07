//! What happens when the program itself is wrong: say so, then start again. A gateway that hangs is worse than
//! one that restarts.

use core::panic::PanicInfo;

use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, exception};

use crate::log::log;

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    let line = info.location().map_or(0, |location| location.line());
    let file = info.location().map_or("?", |location| location.file());
    log!(error, "panic at {=str}:{=u32}", file, line);
    SCB::sys_reset()
}

// SAFETY: the handler runs on the interrupted stack and touches only the reset register.
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    log!(error, "hard fault at {=u32:#010x}", frame.pc());
    SCB::sys_reset()
}
