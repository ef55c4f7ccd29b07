//! The virtual board's core: rsemu's interpreter with the board's repairs and its fast path.

use std::sync::Arc;

use clino_board::BareCore;
use rsemu::core::device::{Device, ResetKind};
use rsemu::core::space::{AddressSpace, Mapping, Perms, RamStore, Region as Mapped};
use rsemu::cpu::arm::v7m::sys::Exception;
use rsemu::cpu::arm::v7m::{ArmV7m, Config, Regs};

use super::code::Code;
use super::layout::{INTERRUPT, INTERRUPT_EXCEPTION, Region, STOP, TABLE};
use super::state::{Condition, State};

/// `CPACR`: both halves of the floating-point unit.
const FPU_ON: u32 = 0xF << 20;
/// `CFSR`: `BFAR` is valid.
const BFARVALID: u32 = 1 << 15;
/// `CONTROL`: the process stack is in use, in thread mode.
const SPSEL: u32 = 2;

/// The core and its memories.
pub struct Core {
    bare: BareCore,
    memories: Vec<(Region, Arc<RamStore>)>,
}

impl Core {
    /// A core with these memories.
    pub fn new(regions: &[Region]) -> Core {
        let space = AddressSpace::new("mem", 32);
        let store = |region: &Region| Arc::new(RamStore::new(u64::from(region.length)));
        let memories: Vec<_> = regions.iter().map(|region| (*region, store(region))).collect();
        {
            let mut topology = space.topology();
            for (region, store) in &memories {
                let ram = Mapped::ram("memory", Arc::clone(store));
                let mapped = if region.is_ram {
                    ram
                } else {
                    // As the emulator's flash: read from a store, written through something else, here lost.
                    let length = u64::from(region.length);
                    let read = Mapping::new(ram, 0).with_perms(Perms::RX);
                    let lost = Mapped::ram("lost", Arc::new(RamStore::new(length)));
                    let written = Mapping::new(lost, 0).with_perms(Perms::WRITE);
                    Mapped::container("flash", length, vec![read, written])
                };
                topology.map(mapped, u64::from(region.base)).expect("the regions are apart");
            }
        }
        let core = ArmV7m::new(Config::CORTEX_M4F.with_reset_vtor(TABLE.base).with_priority_bits(4));
        core.attach_space(Arc::new(space));
        Core { bare: BareCore::new(core), memories }
    }

    /// Writes memory, as a programmer does.
    pub fn write(&mut self, address: u32, bytes: &[u8]) {
        let (region, store) = self.memory(address);
        store.write_at(u64::from(address - region.base), bytes).expect("inside");
    }

    /// Reads memory.
    pub fn read(&self, address: u32, into: &mut [u8]) {
        let (region, store) = self.memory(address);
        store.read_at(u64::from(address - region.base), into).expect("inside");
    }

    /// Whether there is memory.
    pub fn has(&self, address: u32) -> bool {
        self.memories.iter().any(|(region, _)| address.wrapping_sub(region.base) < region.length)
    }

    fn memory(&self, address: u32) -> (Region, &RamStore) {
        let found =
            self.memories.iter().find(|(region, _)| address.wrapping_sub(region.base) < region.length);
        let (region, store) = found.expect("an address of a memory");
        (*region, store)
    }

    /// After a reset, in thread mode, with these registers.
    pub fn arrange(&mut self, state: &State) {
        let core = &self.bare.core;
        core.reset(ResetKind::Cold);
        // Takes the stack pointer and the program counter from the table.
        core.step();
        core.with_sys(|sys| {
            sys.cpacr = FPU_ON;
            sys.set_enable(Exception(INTERRUPT_EXCEPTION as u16), true);
            sys.priority[INTERRUPT_EXCEPTION as usize] = 0x80;
        });
        let mut regs = Regs::new();
        regs.r = state.r;
        regs.xpsr = state.xpsr;
        regs.primask = state.primask != 0;
        regs.faultmask = state.faultmask != 0;
        regs.basepri = state.basepri as u8;
        regs.control = state.control;
        (regs.msp, regs.psp) = if state.control & SPSEL == 0 {
            (state.r[13], state.other_sp)
        } else {
            (state.other_sp, state.r[13])
        };
        core.set_regs(regs);
        for (number, value) in (0..).zip(state.s) {
            core.set_s(number, value);
        }
        core.set_fpscr(state.fpscr);
    }

    /// Its registers.
    pub fn state(&self) -> State {
        let core = &self.bare.core;
        let regs = core.regs();
        let (cfsr, hfsr, bfar) = core.with_sys(|sys| (sys.cfsr, sys.hfsr, sys.bfar));
        let in_use = regs.r[13];
        State {
            r: regs.r,
            xpsr: regs.xpsr,
            primask: u32::from(regs.primask),
            faultmask: u32::from(regs.faultmask),
            basepri: u32::from(regs.basepri),
            control: regs.control,
            other_sp: if in_use == regs.msp && regs.control & SPSEL == 0 || core.current_exception().0 != 0 {
                regs.psp
            } else {
                regs.msp
            },
            s: std::array::from_fn(|number| core.s(number as u8)),
            fpscr: core.fpscr(),
            cfsr,
            hfsr,
            bfar: if cfsr & BFARVALID != 0 { bfar } else { 0 },
            condition: if core.is_locked_up() { Condition::LockedUp } else { Condition::Runs },
        }
    }

    /// The interrupt becomes pending.
    pub fn interrupt(&mut self) {
        self.bare.core.pend_irq(INTERRUPT);
    }

    /// Executes `count` instructions, or up to the handler of a fault, or up to data; calls `seen` with the address of each.
    /// Returns how many there were before data.
    pub fn run(&mut self, count: u64, code: &Code, mut seen: impl FnMut(u32)) -> Option<u64> {
        let mut done = 0;
        while done < count {
            let core = &self.bare.core;
            let before = core.current_exception().0;
            let pc = core.pc();
            if core.is_locked_up() || pc == STOP {
                return None;
            }
            // Where no memory is, the fetch fails, and that is compared.
            if self.has(pc) && !code.has(pc) {
                return Some(done);
            }
            self.bare.step();
            let after = self.bare.core.current_exception().0;
            // To enter the interrupt's handler is a step, but no instruction.
            let entered = before == 0 && u32::from(after) == INTERRUPT_EXCEPTION;
            if !entered {
                seen(pc);
                done += 1;
            }
        }
        None
    }

    /// Instructions that the fast path has executed.
    pub fn by_fast_path(&self) -> u64 {
        self.bare.by_fast_path
    }
}
