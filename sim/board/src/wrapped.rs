//! A stock peripheral with the board's registers in front of its own.
//!
//! What is different about such a device, its [`Front`] says: how its registers read and write, an output more, what else
//! a reset does. Everything else goes to the stock device as it comes, except for what neither of the devices wrapped
//! here has (execution budgets, DMA, acknowledge cycles), and snapshots, which the board does not take.

use std::sync::Arc;

use rsemu::core::Result;
use rsemu::core::clock::ClockControl;
use rsemu::core::device::{Deferred, Device, DeviceClass, Export, ExportId, RealizeCtx, ResetKind, SinkPin};
use rsemu::core::error::Error;
use rsemu::core::sched::LazyHandle;
use rsemu::core::space::{MemOps, Region, RegionKind, RegionRef};
use rsemu::core::wire::{WireId, WireSource};
use rsemu::machine::{BindCtx, Instance};

/// Registers that stand in front of a stock device's, and what else they change about it.
pub(crate) trait Front: MemOps + 'static {
    /// An output that the stock device does not have.
    const OUTPUT: Option<&str> = None;

    /// Takes the line at that output.
    fn connect(&self, _line: WireSource) {}

    /// The stock device has been reset.
    fn reset(&self) {}
}

/// A stock device behind its front.
#[derive(Debug)]
pub(crate) struct Wrapped<F> {
    stock: Arc<dyn Instance>,
    front: Arc<F>,
    region: RegionRef,
}

impl<F: Front> Wrapped<F> {
    /// Puts what `front` makes of the registers of `stock` in front of them.
    ///
    /// # Errors
    ///
    /// `stock` has no registers.
    pub fn new(stock: Arc<dyn Instance>, front: impl FnOnce(Arc<dyn MemOps>) -> F) -> Result<Self> {
        let none = || Error::State(format!("the stock device `{}` has no registers", stock.class().name));
        let region = stock.region("").ok_or_else(none)?;
        let RegionKind::Io(registers) = region.kind() else { return Err(none()) };
        let front = Arc::new(front(Arc::clone(registers)));
        let ops: Arc<dyn MemOps> = Arc::clone(&front) as Arc<dyn MemOps>;
        let region = Arc::new(Region::io(region.name(), region.len(), ops));
        Ok(Wrapped { stock, front, region })
    }

    /// What stands in front.
    pub fn front(&self) -> Arc<F> {
        Arc::clone(&self.front)
    }
}

impl<F: Front> Device for Wrapped<F> {
    fn class(&self) -> &'static DeviceClass {
        self.stock.class()
    }

    fn realize(&self, ctx: &mut RealizeCtx<'_>) -> Result<()> {
        self.stock.realize(ctx)
    }

    fn reset(&self, kind: ResetKind) {
        self.stock.reset(kind);
        self.front.reset();
    }

    fn debug_halt(&self, halted: bool) {
        self.stock.debug_halt(halted);
    }

    fn region(&self, name: &str) -> Option<RegionRef> {
        if name.is_empty() { Some(Arc::clone(&self.region)) } else { self.stock.region(name) }
    }

    fn export(&self, which: ExportId) -> Option<Export> {
        self.stock.export(which)
    }

    fn sink(&self, port: &str, sources: &[WireId]) -> Option<SinkPin> {
        self.stock.sink(port, sources)
    }

    fn connect(&self, port: &str, source: WireSource) -> Result<()> {
        if F::OUTPUT != Some(port) {
            return self.stock.connect(port, source);
        }
        self.front.connect(source);
        Ok(())
    }

    fn announce(&self, port: &str) {
        if F::OUTPUT != Some(port) {
            self.stock.announce(port);
        }
    }

    fn event(&self, token: u64, deferred: &mut Deferred) {
        self.stock.event(token, deferred);
    }

    fn is_lazy(&self) -> bool {
        self.stock.is_lazy()
    }

    fn current_tick(&self) -> u64 {
        self.stock.current_tick()
    }

    fn advance_to(&self, tick: u64) {
        self.stock.advance_to(tick);
    }

    fn next_event_tick(&self) -> Option<u64> {
        self.stock.next_event_tick()
    }

    fn attach_lazy(&self, handle: LazyHandle) {
        self.stock.attach_lazy(handle);
    }

    fn attach_clock_control(&self, control: Arc<ClockControl>) {
        self.stock.attach_clock_control(control);
    }
}

impl<F: Front> Instance for Wrapped<F> {
    fn bind(&self, ctx: &BindCtx<'_>) -> Result<()> {
        self.stock.bind(ctx)
    }
}
