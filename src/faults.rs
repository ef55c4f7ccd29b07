//! Reaction to an internal error: note it for the next start, and restart. A gateway that hangs is
//! worse than one that restarts.
//!
//! | exception | meaning | noted |
//! |---|---|---|
//! | HardFault | any fault: the others are not enabled, and come here | kind, registers, fault status |
//! | NMI | the crystal has stopped (RM0090 section 7.2.7) | registers; the next start is without it |
//! | SysTick | the watchdog's tick | see `watchdog.rs` |
//! | panic | the program has detected an internal error | file and line |
//!
//! A fault may be that the stack has run out of its memory: then nothing can be put on it, and the fault's handler has a
//! stack of its own (`memory.x`).

use core::arch::naked_asm;
use core::panic::PanicInfo;
use core::ptr;

use clino_recovery::{Crash, FaultStatus, Registers};

use crate::{board, start};

/// The registers that the core puts on the stack when an exception begins (PM0214 section 2.3.7).
#[repr(C)]
pub struct Frame {
    _r0: u32,
    _r1: u32,
    _r2: u32,
    _r3: u32,
    _r12: u32,
    lr: u32,
    pc: u32,
    xpsr: u32,
}

/// The bits of xPSR that name the exception that was active.
const EXCEPTION: u32 = 0x1FF;

unsafe extern "C" {
    /// Lower end of the stack, and first address above it (`memory.x`).
    static _stack_end: u8;
    static _stack_start: u8;
}

impl Frame {
    /// Whether all of it is in the stack's memory.
    fn is_inside(frame: *const Frame) -> bool {
        let stack =
            ptr::addr_of!(_stack_end).addr()..=ptr::addr_of!(_stack_start).addr() - size_of::<Frame>();
        stack.contains(&frame.addr()) && frame.is_aligned()
    }

    /// Where the program was. `frame` is in the stack's memory.
    pub fn registers(frame: *const Frame) -> Registers {
        // SAFETY: the core has just written it, and it is in memory.
        let Frame { lr, pc, xpsr, .. } = unsafe { frame.read() };
        Registers { pc, lr, sp: frame.addr() as u32, exception: (xpsr & EXCEPTION) as u16 }
    }

    /// The same, if it is.
    fn known(frame: *const Frame) -> Option<Registers> {
        Frame::is_inside(frame).then(|| Frame::registers(frame))
    }
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    // Nothing is logged here, nor in the other handlers: it may have been the log that panicked. The next start says it.
    cortex_m::interrupt::disable();
    note_panic(info)
}

/// Notes it for the next start, which is now. A function of its own: it runs with interrupts off, so that its stack is not below
/// that of other levels, as the handler's is until it has switched them off.
#[inline(never)]
fn note_panic(info: &PanicInfo<'_>) -> ! {
    let line = info.location().map_or(0, |location| location.line());
    let file = info.location().map_or("", |location| location.file());
    start::crash(&Crash::panic(file, line))
}

/// Any fault. On a stack of its own, because the usual one may be the fault.
///
/// # Safety
/// The core calls it.
// SAFETY: the name is that of the vector.
#[unsafe(naked)]
#[unsafe(no_mangle)]
unsafe extern "C" fn HardFault() -> ! {
    naked_asm!(
        "mrs r0, msp",
        "movw r1, #:lower16:_fault_stack_start",
        "movt r1, #:upper16:_fault_stack_start",
        "mov sp, r1",
        "b {fault}",
        fault = sym fault,
    )
}

extern "C" fn fault(frame: *const Frame) -> ! {
    let [cfsr, hfsr, mmfar, bfar] = board::fault_status();
    let status = FaultStatus::new(cfsr, hfsr, mmfar, bfar);
    let registers = Frame::known(frame);
    start::crash(&Crash::fault(status, registers, registers.is_none()))
}

/// The crystal has stopped, and the core runs from the internal oscillator.
///
/// # Safety
/// The core calls it.
// SAFETY: the name is that of the vector.
#[unsafe(naked)]
#[unsafe(no_mangle)]
unsafe extern "C" fn NonMaskableInt() {
    naked_asm!("mrs r0, msp", "b {crystal}", crystal = sym crystal)
}

extern "C" fn crystal(frame: *const Frame) {
    if board::crystal_has_stopped() {
        start::crash(&Crash::clock_failed(Frame::known(frame)))
    }
}
