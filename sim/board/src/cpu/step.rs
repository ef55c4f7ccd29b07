//! One step of the core: an instruction, an exception entry, or a cycle asleep.
//!
//! The emulator loses ITSTATE, the bits of the program status that say how far an IT block has come, in two
//! places where ARM DDI 0403 B1.5.6 and B1.5.8 keep it, and a block would go on with the wrong conditions:
//!
//! - Exception entry stacks the program status without it. It is put into the frame here.
//! - An exception return that is itself in an IT block advances the state just restored as if it were its own.
//!   It is taken from the frame again here.
//!
//! It also loses FPSCR, the comparison's flags among it, where it only reserves the floating-point part of a frame: it starts
//! the handler with the default value at once, and an exception return that finds nothing stacked restores nothing.
//! ARM DDI 0403 B1.5.7 leaves FPSCR alone until the handler's first floating-point instruction, which stacks it. It is put
//! back here.
//!
//! And where the frame of an exception cannot be stacked (the stack has left RAM), it goes on into the handler. ARM DDI
//! 0403 B1.5.6 makes that a fault of its own that comes first: HardFault is entered in its place here, and the exception is
//! pending. (BusFault, if enabled, would take its place; the gateway does not enable it.) HardFault itself is entered
//! even so, as on the part; what it pushes on such a stack locks the core up.

use rsemu::core::space::{AddressSpace, MemAttrs};
use rsemu::core::value::Width;
use rsemu::cpu::arm::v7m::sys::{Exception, fsr};
use rsemu::cpu::arm::v7m::{ArmV7m, Regs, xpsr};

/// Offsets in an exception frame (ARM DDI 0403 B1.5.6).
mod frame {
    pub const LR: u32 = 20;
    pub const PC: u32 = 24;
    pub const XPSR: u32 = 28;
    /// Lengths without and with floating-point registers.
    pub const BASIC: u32 = 32;
    pub const EXTENDED: u32 = 104;
    /// Bit of the stacked program status: the frame was moved down by a word to be aligned.
    pub const ALIGNED: u32 = 1 << 9;
}

/// The fewest cycles that an exception entry takes in the emulator; most instructions take fewer.
const ENTRY_CYCLES: u64 = 12;
/// Bit of EXC_RETURN: the frame is on the process stack (ARM DDI 0403 B1.5.8).
const EXC_RETURN_SPSEL: u32 = 1 << 2;
/// Bit of FPCCR: the floating-point part of a frame is reserved, not stacked; so nothing has used the unit since.
const FPCCR_LSPACT: u32 = 1;
/// Bit of CONTROL: the context uses the floating-point unit, so its frame was an extended one.
const CONTROL_FPCA: u32 = 1 << 2;

/// Takes one step; returns the cycles it took, 0 if the core cannot run.
pub(super) fn step(core: &ArmV7m) -> u64 {
    let fpscr = core.fpscr();
    let cycles = step_but_for_floats(core);
    // What the emulator sets it to is 0, unless firmware says otherwise; ours does not.
    if fpscr != 0 && core.fpscr() != fpscr && core.with_sys(|sys| sys.fpccr & FPCCR_LSPACT != 0) {
        core.set_fpscr(fpscr);
    }
    cycles
}

fn step_but_for_floats(core: &ArmV7m) -> u64 {
    let it_state = core.xpsr() & xpsr::IT_MASK;
    if it_state == 0 {
        let cycles = core.step();
        mend_failed_entry(core, cycles);
        return cycles;
    }
    let before = core.with_sys(|sys| sys.active);
    let cycles = core.step();
    let after = core.with_sys(|sys| sys.active);
    let Some(space) = core.space().filter(|_| before != after) else { return cycles };
    let began = before.iter().zip(&after).any(|(before, after)| after & !before != 0);
    let ended = before.iter().zip(&after).any(|(before, after)| before & !after != 0);
    // Both at once is a tail-chained entry: nothing is stacked or restored.
    match (began, ended) {
        (true, false) => stack_it_state(&space, &core.regs(), it_state),
        (false, true) => restore_it_state(&space, core),
        _ => {}
    }
    mend_failed_entry(core, cycles);
    cycles
}

/// Enters HardFault in place of an exception that was just entered, if its frame could not be stacked.
fn mend_failed_entry(core: &ArmV7m, cycles: u64) {
    if cycles < ENTRY_CYCLES {
        return;
    }
    let entered = core.current_exception();
    if entered.0 <= Exception::HARD_FAULT.0 {
        return;
    }
    let vector = core.with_sys(|sys| {
        let failed = sys.cfsr & fsr::BF_STKERR != 0;
        failed.then(|| {
            sys.set_active(entered, false);
            sys.set_pending(entered, true);
            sys.set_active(Exception::HARD_FAULT, true);
            sys.vtor.wrapping_add(Exception::HARD_FAULT.vector_offset())
        })
    });
    let Some((space, vector)) = core.space().zip(vector) else { return };
    // The table is in flash: it can be read.
    let handler = read(&space, vector).unwrap_or_default();
    core.set_xpsr(core.xpsr() & !xpsr::EXCEPTION | u32::from(Exception::HARD_FAULT.0));
    core.set_pc(handler & !1);
}

fn read(space: &AddressSpace, address: u32) -> Option<u32> {
    space.read(u64::from(address), Width::U32, MemAttrs::DEBUG).ok().map(|word| word as u32)
}

/// Puts `it_state` into the frame just stacked; `regs` are those of the handler's first instruction.
fn stack_it_state(space: &AddressSpace, regs: &Regs, it_state: u32) {
    let on_process_stack = regs.r[14] & EXC_RETURN_SPSEL != 0;
    let frame = if on_process_stack { regs.psp } else { regs.msp };
    let stacked = frame.wrapping_add(frame::XPSR);
    // The frame was written a moment ago. Where that failed (a stack outside RAM), so does this.
    if let Some(xpsr) = read(space, stacked) {
        let whole = u64::from(xpsr | it_state);
        let _ = space.write(u64::from(stacked), Width::U32, whole, MemAttrs::DEBUG);
    }
}

/// Takes ITSTATE from the frame just unstacked, which still lies below the stack pointer.
fn restore_it_state(space: &AddressSpace, core: &ArmV7m) {
    let regs = core.regs();
    let length = if regs.control & CONTROL_FPCA != 0 { frame::EXTENDED } else { frame::BASIC };
    let stacked_xpsr = |padding: u32| {
        let frame = regs.r[13].wrapping_sub(length + padding);
        let xpsr = read(space, frame.wrapping_add(frame::XPSR))?;
        let fits = read(space, frame.wrapping_add(frame::PC))? == regs.r[15]
            && read(space, frame.wrapping_add(frame::LR))? == regs.r[14]
            && (xpsr & frame::ALIGNED != 0) == (padding != 0);
        fits.then_some(xpsr)
    };
    if let Some(xpsr) = stacked_xpsr(0).or_else(|| stacked_xpsr(4)) {
        core.set_xpsr(regs.xpsr & !xpsr::IT_MASK | xpsr & xpsr::IT_MASK);
    }
}
