//! The core as a device of the emulator: pins, reset, and its share of the machine's time.

use super::Cpu;
use super::reset::FLAGS;
use crate::timeline::lock;
use rsemu::core::Result;
use rsemu::core::device::{Device, DeviceClass, ExportId, RealizeCtx, ResetKind, SinkPin};
use rsemu::core::sched::{Budget, Consumed, TickCursor};
use rsemu::core::sync::Ordering;
use rsemu::core::wire::{WireId, WireSink, WireSource};
use rsemu::cpu::arm::v7m;
use rsemu::dev::stm32::Clocks;
use rsemu::machine::validate::{ClassSchema, PortDir};
use rsemu::machine::{BindCtx, Instance};
use std::sync::Arc;

/// Class name in the board text.
pub(crate) const CLASS_NAME: &str = "clino.cortex-m4f";

static CLASS: DeviceClass = DeviceClass {
    name: CLASS_NAME,
    version: 1,
    summary: "Cortex-M4F that keeps peripherals to the cycle and skips sleep",
    properties: &[],
    construct: |_| Err(rsemu::core::Error::Unimplemented("built by the board only")),
};

/// The class as the emulator's registry wants it.
pub(crate) fn class() -> &'static DeviceClass {
    &CLASS
}

/// What the board text may say about the class.
pub(crate) fn schema() -> ClassSchema {
    let mut schema = v7m::schema();
    schema.class = CLASS_NAME.to_string();
    FLAGS.iter().fold(schema, |schema, port| schema.port(*port, PortDir::Out))
}

impl std::fmt::Debug for Cpu {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Cpu").field("core", &self.core).finish_non_exhaustive()
    }
}

impl Device for Cpu {
    fn class(&self) -> &'static DeviceClass {
        &CLASS
    }

    fn realize(&self, ctx: &mut RealizeCtx<'_>) -> Result<()> {
        let _ = self.machine_reset.set(ctx.machine_reset()?);
        self.core.realize(ctx)
    }

    fn reset(&self, _kind: ResetKind) {
        // A system reset leaves nothing of the core or its system block as it was (ARM DDI 0403 B1.5.5).
        self.core.reset(ResetKind::Cold);
        self.reset_line.asserted.store(false, Ordering::Relaxed);
    }

    fn sink(&self, port: &str, sources: &[WireId]) -> Option<SinkPin> {
        if port == "reset" {
            return Some(SinkPin { sink: Arc::clone(&self.reset_line) as Arc<dyn WireSink>, line: 0 });
        }
        if let Some(line) = port.strip_prefix("irq").and_then(|line| line.parse().ok()) {
            lock(&self.work).fast.wired.push(line);
        }
        self.core.sink(port, sources)
    }

    fn connect(&self, port: &str, source: WireSource) -> Result<()> {
        match FLAGS.iter().find(|flag| **flag == port) {
            None => self.core.connect(port, source),
            Some(flag) => {
                lock(&self.flags).insert(flag, source);
                Ok(())
            }
        }
    }

    fn is_runnable(&self) -> bool {
        true
    }

    fn attach_cursor(&self, cursor: TickCursor) {
        // Not handed to the inner core: positions are published here, once per instruction.
        self.timeline.follow(cursor);
    }

    fn run(&self, budget: Budget) -> Consumed {
        let Some(cursor) = self.timeline.cursor() else { return Consumed::default() };
        let mut work = lock(&self.work);
        Consumed::new(self.run_round(&mut work, cursor, budget.ticks))
    }
}

impl Instance for Cpu {
    fn bind(&self, ctx: &BindCtx<'_>) -> Result<()> {
        let clocks = ctx.export_as::<Clocks>("rcc", ExportId::CLOCK_TREE)?;
        let _ = self.clocks.set(clocks);
        self.core.bind(ctx)
    }
}
