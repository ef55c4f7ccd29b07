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
