//! The core as the board executes it, on memories of the caller's, without a board around it: for comparison with other
//! cores (`witness`).

use rsemu::core::Result;
use rsemu::core::device::{Device, DeviceClass, RealizeCtx, ResetKind};
use rsemu::core::sched::TickCursor;
use rsemu::cpu::arm::v7m::ArmV7m;

use super::fast::{Course, Fast};
use super::step::step;

/// A core of the emulator, with the board's repairs and its fast path.
pub struct BareCore {
    /// The emulator's core: its registers, and what its system block has.
    pub core: ArmV7m,
    fast: Fast,
    cursor: TickCursor,
    /// Steps that the fast path took.
    pub by_fast_path: u64,
}

impl BareCore {
    /// `core`, which has its address map.
    #[must_use]
    pub fn new(core: ArmV7m) -> BareCore {
        BareCore { core, fast: Fast::default(), cursor: TickCursor::new(), by_fast_path: 0 }
    }

    /// Executes an instruction, enters an exception, or sleeps for a cycle, by the fast path where the board would.
    pub fn step(&mut self) {
        let course = Course { cursor: &self.cursor, at: 0, limit: 1, devices: &Still };
        if self.fast.run(&self.core, &course, |_, _| true).instructions > 0 {
            self.by_fast_path += 1;
        } else {
            step(&self.core);
        }
    }
}

/// No devices: nothing moves between two instructions.
#[derive(Debug)]
struct Still;

impl Device for Still {
    fn class(&self) -> &'static DeviceClass {
        super::class()
    }

    fn realize(&self, _: &mut RealizeCtx<'_>) -> Result<()> {
        Ok(())
    }

    fn reset(&self, _: ResetKind) {}
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use rsemu::core::space::{AddressSpace, RamStore, Region};
    use rsemu::core::value::{Endian, Width};
    use rsemu::cpu::arm::v7m::sys::Exception;
    use rsemu::cpu::arm::v7m::{Config, Regs, xpsr};

    use super::*;

    const RAM: u32 = 0x2000_0000;
    /// Where the interrupted code is, and the handlers.
    const CODE: u32 = RAM + 0x400;
    const HANDLER: u32 = RAM + 0x500;
    const OTHER: u32 = RAM + 0x600;
    const LINE: u16 = 3;
    const OTHER_LINE: u16 = 4;
    const NOP: u32 = 0xBF00;
    const BX_LR: u32 = 0x4770;
    /// `VMOV.F32 s0, #2.0`.
    const VMOV: (u32, u32) = (0xEEB0, 0x0A00);
    /// What a comparison has left: Z and C.
    const FLAGS: u32 = 0x6000_0000;
    const FPCA: u32 = 1 << 2;
    /// The interrupt in the middle, the other one on its heels, the return.
    const STEPS: usize = 12;

    /// A core in the middle of code that uses the floating-point unit, whose handlers begin with these instructions.
    fn core(handler: &[u32]) -> BareCore {
        let ram = Arc::new(RamStore::new(0x2000));
        let half = |at: u32, half: u32| {
            ram.write_value(u64::from(at - RAM), Width::U16, u64::from(half), Endian::Little).unwrap();
        };
        for vector in 0..64 {
            let entry = match vector {
                0 => RAM + 0x2000,
                19 => HANDLER | 1,
                _ => OTHER | 1,
            };
            half(RAM + 4 * vector, entry & 0xffff);
            half(RAM + 4 * vector + 2, entry >> 16);
        }
        (0..32).for_each(|number| half(CODE + 2 * number, NOP));
        for place in [HANDLER, OTHER] {
            for (number, instruction) in (0..).zip(handler) {
                half(place + 2 * number, *instruction);
            }
        }
        let space = AddressSpace::new("mem", 32);
        space.topology().map(Region::ram("ram", Arc::clone(&ram)), u64::from(RAM)).unwrap();
        let core = ArmV7m::new(Config::CORTEX_M4F.with_reset_vtor(RAM));
        core.attach_space(Arc::new(space));
        core.step();
        core.with_sys(|sys| {
            sys.cpacr = 0xF << 20;
            for line in [LINE, OTHER_LINE] {
                sys.set_enable(Exception(Exception::IRQ0.0 + line), true);
            }
        });
        let mut regs = Regs::new();
        regs.msp = RAM + 0x1800;
        regs.r[13] = regs.msp;
        regs.r[15] = CODE;
        regs.xpsr = xpsr::T;
        regs.control = FPCA;
        core.set_regs(regs);
        core.set_fpscr(FLAGS);
        BareCore::new(core)
    }

    #[test]
    fn the_flags_of_a_comparison_outlive_an_interrupt() {
        let returning = [BX_LR].as_slice();
        let with_floats = [VMOV.0, VMOV.1, BX_LR].as_slice();
        for handler in [returning, with_floats] {
            let mut bare = core(handler);
            bare.step();
            bare.core.pend_irq(LINE);
            bare.step();
            assert_ne!(bare.core.current_exception().0, 0, "it is in the handler");
            // The second begins where the first ends, without a return in between.
            bare.core.pend_irq(OTHER_LINE);
            for _ in 0..STEPS {
                bare.step();
            }
            assert_eq!(bare.core.current_exception().0, 0, "it has returned");
            assert_eq!(bare.core.fpscr(), FLAGS, "{handler:x?}");
        }
    }
}
