//! The fast path: a run of instructions that touch nothing but registers and memory.
//!
//! The emulator looks at its interrupt inputs, its pending exceptions and its address map at each instruction. Between two
//! accesses to a peripheral none of these can change but by a device that is caught up, and that is seen here. So such
//! instructions are executed here, by the emulator's own decoder and on its own memories, and everything else is left to it:
//! peripherals, exceptions, faults, masks, floating point, exclusive accesses, unaligned ones, code in RAM.
//!
//! Nobody can tell the difference: registers, flags, memory, cycles and the instants of the looks in `round` are the same.
//! The tests hold the two against each other, instruction by instruction.

mod alu;
mod code;
mod execute;
mod memory;

use rsemu::core::device::Device;
use rsemu::core::sched::TickCursor;
use rsemu::cpu::arm::v7m::sys::{Exception, Sys, fsr};
use rsemu::cpu::arm::v7m::{ArmV7m, xpsr};

use code::Code;
use execute::State;
use memory::Memory;

/// Bit of CONTROL: the process stack is in use.
const CONTROL_SPSEL: u32 = 1 << 1;
/// Bit of SYST_CSR: SysTick counts.
const SYSTICK_ENABLE: u32 = 1;
/// Bits of SysTick's counter.
const SYSTICK_BITS: u32 = 0x00ff_ffff;

/// What is kept from one run to the next.
#[derive(Default)]
pub(super) struct Fast {
    memory: Memory,
    code: Code,
    /// The interrupt inputs that something is wired to.
    pub wired: Vec<u16>,
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
        let Some(space) = core.space() else { return stretch };
        if self.memory.follow(&space) || self.memory.flash_has_changed() {
            self.code = Code::of(&self.memory);
        }
        let mut regs = core.regs();
        let mut state = State { r: regs.r, xpsr: regs.xpsr };
        let Some(first) = self.code.at(state.r[15], &self.memory) else { return stretch };
        if regs.control & CONTROL_SPSEL != 0 || regs.xpsr & xpsr::T == 0 {
            return stretch;
        }
        let Some(until_tick) = self.undisturbed(core) else { return stretch };
        let end = course.limit.saturating_sub(course.at).min(until_tick);
        let now = course.devices.current_tick();
        let mut decoded = first;
        while let Ok(cycles) = state.execute(decoded, &self.memory) {
            stretch.instructions += 1;
            stretch.cycles += cycles;
            if !goes_on(state.r[13], state.r[15]) || stretch.cycles >= end {
                break;
            }
            let Some(next) = self.code.at(state.r[15], &self.memory) else { break };
            decoded = next;
            course.cursor.set(course.at + stretch.cycles);
            if course.devices.current_tick() != now {
                break;
            }
        }
        if stretch.instructions > 0 {
            (regs.r, regs.xpsr, regs.msp) = (state.r, state.xpsr, state.r[13]);
            core.set_regs(regs);
            core.with_sys(|sys| pass(sys, stretch.cycles));
        }
        stretch
    }

    /// The cycles up to SysTick's next wrap, if no exception is about to be entered and the core is awake. As the emulator
    /// does before an instruction, inputs that are high make their interrupts pending.
    fn undisturbed(&self, core: &ArmV7m) -> Option<u64> {
        if core.is_asleep() || core.is_locked_up() || core.reset_pending() || core.nmi_asserted() {
            return None;
        }
        let (waiting, until_tick) = core.with_sys(|sys| {
            for line in self.wired.iter().filter(|line| core.irq_asserted(**line)) {
                let exception = Exception(line + Exception::IRQ0.0);
                if !sys.is_active(exception) {
                    sys.set_pending(exception, true);
                }
            }
            (sys.highest_pending(), until_tick(sys))
        });
        let takes_over = |priority| priority < core.execution_priority();
        if waiting.is_some_and(|(_, priority)| takes_over(priority)) { None } else { until_tick }
    }
}

/// The cycles up to SysTick's next wrap, unless there is something in the system block that the emulator has to mind.
fn until_tick(sys: &Sys) -> Option<u64> {
    // Protected memory; and a frame that could not be stacked: see `step`.
    if sys.mpu_ctrl & 1 != 0 || sys.cfsr & fsr::BF_STKERR != 0 {
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
