//! The fast path: executes instructions that touch only registers and memory, several times as fast as the emulator.
//!
//! The emulator samples its interrupt inputs, arbitrates its pending exceptions and searches its address map at each
//! instruction. Between two accesses to a peripheral, these change only when the emulator catches up a device, and the fast
//! path ends there. It uses the emulator's decoder and the emulator's memories. The emulator executes everything else:
//! accesses to peripherals, exceptions, faults, floating point, exclusive accesses, code in RAM.
//!
//! Registers, flags, memory, cycle counts and the instants of the looks in `round` are the same as without it. `tests`
//! compares it with the emulator, instruction by instruction; `host-tests` compares a whole run.

mod alu;
mod code;
mod execute;
mod lowering;
mod memory;
mod op;
mod state;
#[cfg(test)]
mod tests;
mod transfer;

use std::sync::Arc;

use rsemu::core::device::Device;
use rsemu::core::sched::TickCursor;
use rsemu::core::space::AddressSpace;
use rsemu::cpu::arm::v7m::sys::{Exception, Sys, ccr, fsr};
use rsemu::cpu::arm::v7m::{ArmV7m, Regs, xpsr};

use code::Code;
use memory::Memory;
use state::State;

/// Bit of CONTROL: the process stack is in use.
const CONTROL_SPSEL: u32 = 1 << 1;
/// Bit of CONTROL: not privileged.
const CONTROL_NPRIV: u32 = 1;
/// Bit of SYST_CSR: SysTick counts.
const SYSTICK_ENABLE: u32 = 1;
/// Bits of SysTick's counter.
const SYSTICK_BITS: u32 = 0x00ff_ffff;

/// The fast path's view of the memories, and the instructions decoded so far.
#[derive(Default)]
pub(super) struct Fast {
    space: Option<Arc<AddressSpace>>,
    memory: Memory,
    code: Code,
    /// The interrupt inputs that something is wired to.
    pub wired: Vec<u16>,
    /// The emulator executes every instruction.
    pub is_off: bool,
}

/// What a run has executed.
#[derive(Default)]
pub(super) struct Stretch {
    pub instructions: u64,
    pub cycles: u64,
}

/// Where a run begins and ends.
pub(super) struct Course<'a> {
    pub cursor: &'a TickCursor,
    /// The cycle at which it begins.
    pub at: u64,
    /// No instruction begins at or after this cycle.
    pub limit: u64,
    /// A device whose clock moves on whenever the emulator catches up its devices.
    pub devices: &'a dyn Device,
}

impl Fast {
    /// Executes instructions until `goes_on` returns false, which is called after each with the stack pointer and the address
    /// of the next one.
    pub fn run(
        &mut self,
        core: &ArmV7m,
        course: &Course<'_>,
        mut goes_on: impl FnMut(u32, u32) -> bool,
    ) -> Stretch {
        let mut stretch = Stretch::default();
        if self.is_off || !self.follow(core) {
            return stretch;
        }
        let mut regs = core.regs();
        let is_ordinary = regs.control & (CONTROL_SPSEL | CONTROL_NPRIV) == 0 && regs.xpsr & xpsr::T != 0;
        if !is_ordinary || core.reset_pending() || core.nmi_asserted() {
            return stretch;
        }
        let Some(Outlook { is_undisturbed, until_tick }) = self.outlook(core) else { return stretch };
        let Regs { r, xpsr, primask, basepri, .. } = regs;
        let mut state = State { r, xpsr, primask, basepri, is_undisturbed };
        let end = course.limit.saturating_sub(course.at).min(until_tick);
        let now = course.devices.current_tick();
        let is_asleep = core.is_asleep();
        if is_asleep && !is_undisturbed {
            return stretch;
        }
        loop {
            // A core that sleeps spends a cycle in each step.
            let done = if is_asleep { Some(1) } else { self.step(&mut state) };
            let Some(cycles) = done else { break };
            stretch.instructions += 1;
            stretch.cycles += cycles;
            if !goes_on(state.r[13], state.r[15]) || stretch.cycles >= end {
                break;
            }
            course.cursor.set(course.at + stretch.cycles);
            if course.devices.current_tick() != now {
                break;
            }
        }
        if stretch.instructions > 0 {
            let State { r, xpsr, primask, basepri, .. } = state;
            regs = Regs { r, xpsr, primask, basepri, msp: r[13], ..regs };
            core.set_regs(regs);
            core.with_sys(|sys| pass(sys, stretch.cycles));
        }
        stretch
    }

    /// Follows changes of the address map and of flash; returns whether there is an address map.
    fn follow(&mut self, core: &ArmV7m) -> bool {
        if self.space.is_none() {
            self.space = core.space();
        }
        let Some(space) = &self.space else { return false };
        if self.memory.follow(space) || self.memory.flash_has_changed() {
            self.code = Code::of(&self.memory);
        }
        true
    }

    /// Executes the next instruction, unless the emulator has to; returns its cycles.
    #[inline(always)]
    fn step(&mut self, state: &mut State) -> Option<u64> {
        let op = self.code.at(state.r[15], &self.memory)?;
        state.execute(op, &self.memory).ok()
    }

    /// The state of exceptions and SysTick, unless an exception is about to be entered. As the emulator does before an
    /// instruction, inputs that are high make their interrupts pending.
    fn outlook(&self, core: &ArmV7m) -> Option<Outlook> {
        let (waiting, until_tick) = core.with_sys(|sys| {
            for line in self.wired.iter().filter(|line| core.irq_asserted(**line)) {
                let exception = Exception(line + Exception::IRQ0.0);
                if !sys.is_active(exception) {
                    sys.set_pending(exception, true);
                }
            }
            (sys.highest_pending(), until_tick(sys))
        });
        let until_tick = until_tick?;
        match waiting {
            Some((_, priority)) if priority < core.execution_priority() => None,
            _ => Some(Outlook { is_undisturbed: waiting.is_none(), until_tick }),
        }
    }
}

/// The state of exceptions and SysTick at the beginning of a run.
struct Outlook {
    /// No enabled exception is pending.
    is_undisturbed: bool,
    /// The cycles up to SysTick's next wrap.
    until_tick: u64,
}

/// The cycles up to SysTick's next wrap, unless the system block is set to something that only the emulator knows.
fn until_tick(sys: &Sys) -> Option<u64> {
    // Memory protection, faults of unaligned accesses, and a frame that could not be stacked: see `step`.
    if sys.mpu_ctrl & 1 != 0 || sys.ccr & ccr::UNALIGN_TRP != 0 || sys.cfsr & fsr::BF_STKERR != 0 {
        return None;
    }
    let runs = sys.syst_csr & SYSTICK_ENABLE != 0 && sys.syst_rvr != 0;
    Some(if runs { u64::from(sys.syst_cvr & SYSTICK_BITS) } else { u64::MAX })
}

/// Advances the counters of the core by `cycles`.
fn pass(sys: &mut Sys, cycles: u64) {
    sys.tick_cyccnt(cycles);
    if sys.tick_systick(cycles) && sys.syst_csr & super::stall::SYSTICK_INTERRUPT != 0 {
        sys.set_pending(Exception::SYSTICK, true);
    }
}
