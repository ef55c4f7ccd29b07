//! The fast path: a run of instructions that touch nothing but registers and memory.
//!
//! The emulator looks at its interrupt inputs, its pending exceptions and its address map at each instruction. Between two
//! accesses to a peripheral none of these can change but by a device that is caught up, and that is seen here. So such
//! instructions are executed here, by the emulator's own decoder and on its own memories, and everything else is left to it:
//! peripherals, exceptions, faults, floating point, exclusive accesses, code in RAM.
//!
//! Nobody can tell the difference: registers, flags, memory, cycles and the instants of the looks in `round` are the same.
//! The tests hold the two against each other, instruction by instruction.

mod alu;
mod code;
mod execute;
mod memory;
mod op;
#[cfg(test)]
mod tests;

use rsemu::core::device::Device;
use std::sync::Arc;

use rsemu::core::sched::TickCursor;
use rsemu::core::space::AddressSpace;
use rsemu::cpu::arm::v7m::sys::{Exception, Sys, ccr, fsr};
use rsemu::cpu::arm::v7m::{ArmV7m, Regs, xpsr};

use code::Code;
use execute::State;
use memory::Memory;

/// Bit of CONTROL: the process stack is in use.
const CONTROL_SPSEL: u32 = 1 << 1;
/// Bit of CONTROL: not privileged.
const CONTROL_NPRIV: u32 = 1;
/// Bit of SYST_CSR: SysTick counts.
const SYSTICK_ENABLE: u32 = 1;
/// Bits of SysTick's counter.
const SYSTICK_BITS: u32 = 0x00ff_ffff;

/// What is kept from one run to the next.
#[derive(Default)]
pub(super) struct Fast {
    space: Option<Arc<AddressSpace>>,
    memory: Memory,
    code: Code,
    /// The interrupt inputs that something is wired to.
    pub wired: Vec<u16>,
    /// Everything is left to the emulator.
    pub is_off: bool,
}

/// What a run came to.
#[derive(Default)]
pub(super) struct Stretch {
    pub instructions: u64,
    pub cycles: u64,
}

/// Where a run has to end, and what it is to look at on its way.
pub(super) struct Course<'a> {
    pub cursor: &'a TickCursor,
    /// The cycle at which it begins.
    pub at: u64,
    /// No instruction begins at or after this cycle.
    pub limit: u64,
    /// Its clock moves on whenever the emulator catches up its devices.
    pub devices: &'a dyn Device,
}

impl Fast {
    /// Executes instructions as long as `goes_on` says so, which is asked after each with the stack pointer and the address
    /// of the next.
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
            // A cycle of sleep is a step too.
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

    /// Takes over a new address map, and what was written to flash. Returns whether there is anything to execute.
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

    /// Executes an instruction, if it is one for here; returns its cycles.
    #[inline]
    fn step(&mut self, state: &mut State) -> Option<u64> {
        let op = self.code.at(state.r[15], &self.memory)?;
        state.execute(op, &self.memory).ok()
    }

    /// What is to come, if no exception is about to be entered. As the emulator does before an instruction, inputs that are
    /// high make their interrupts pending.
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

/// What an instruction can count on.
struct Outlook {
    /// No enabled exception is pending.
    is_undisturbed: bool,
    /// The cycles up to SysTick's next wrap.
    until_tick: u64,
}

/// The cycles up to SysTick's next wrap, unless there is something in the system block that the emulator has to mind.
fn until_tick(sys: &Sys) -> Option<u64> {
    // Protected memory; unaligned accesses that are faults; and a frame that could not be stacked: see `step`.
    if sys.mpu_ctrl & 1 != 0 || sys.ccr & ccr::UNALIGN_TRP != 0 || sys.cfsr & fsr::BF_STKERR != 0 {
        return None;
    }
    let runs = sys.syst_csr & SYSTICK_ENABLE != 0 && sys.syst_rvr != 0;
    Some(if runs { u64::from(sys.syst_cvr & SYSTICK_BITS) } else { u64::MAX })
}

/// Lets the counters of the core count `cycles`.
fn pass(sys: &mut Sys, cycles: u64) {
    sys.tick_cyccnt(cycles);
    if sys.tick_systick(cycles) && sys.syst_csr & super::stall::SYSTICK_INTERRUPT != 0 {
        sys.set_pending(Exception::SYSTICK, true);
    }
}
