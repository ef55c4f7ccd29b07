//! The crystal, and what the reset and clock controller makes of one that fails (RM0090 sections 7.2.1 and 7.2.7).
//!
//! The stock controller knows only crystals that start. This adapter stands around its registers:
//!
//! - HSEON does not get through to it while the crystal cannot swing, and reads as firmware has written it: HSERDY
//!   never comes.
//! - If the crystal stops with the clock security system on (CSSON), and the core clock comes from it (directly or
//!   through the PLL), the core clock becomes the internal oscillator's, HSEON and PLLON fall, CSSF rises, and so does
//!   NMI until firmware writes CSSC. If the core clock does not come from it, only HSEON falls, with CSSF and NMI.
//! - Without the clock security system the core stands still until a reset or until the crystal is back.
//!
//! Not modelled: that everything else on the core's clock stands still with it (a character under way is finished; a
//! timer counts on, and nobody reads it), and what a PLL gives for a moment that has lost its input. From the stop to the
//! switch it takes up to 1 µs.

mod pins;

use std::fmt;
use std::sync::Arc;

use rsemu::core::Result;
use rsemu::core::clock::ClockControl;
use rsemu::core::device::{Deferred, Device, DeviceClass, Export, ExportId, RealizeCtx, ResetKind, SinkPin};
use rsemu::core::error::Error;
use rsemu::core::sched::LazyHandle;
use rsemu::core::space::{MemOps, Region, RegionKind, RegionRef};
use rsemu::core::wire::{WireId, WireSource};
use rsemu::dev::stm32::rcc;
use rsemu::machine::validate::{ClassSchema, PortDir};
use rsemu::machine::{BindCtx, Instance};

use crate::incident::Chronicle;
use crate::oscillators::CrystalLife;

pub(crate) use pins::Pins;

/// The stock class that is wrapped.
pub(crate) const STOCK: &str = "st.rcc";
/// The output that is added to it: the failure, for NMI.
const NMI: &str = "nmi";

/// What the stock controller's class is with the line for NMI.
pub(crate) fn schema() -> ClassSchema {
    rcc::schema().port(NMI, PortDir::Out)
}

/// The controller with the crystal at its pins.
pub(crate) struct Crystal {
    inner: Arc<dyn Instance>,
    region: Option<RegionRef>,
    pins: Arc<Pins>,
}

impl Crystal {
    /// Stands around `inner`.
    ///
    /// # Errors
    ///
    /// `inner` has no registers.
    pub fn new(inner: Arc<dyn Instance>, life: CrystalLife, chronicle: Arc<Chronicle>) -> Result<Crystal> {
        let region =
            inner.region("").ok_or_else(|| Error::State("the clock controller has no registers".into()))?;
        let RegionKind::Io(words) = region.kind() else {
            return Err(Error::State("the clock controller's registers are memory".into()));
        };
        let pins = Arc::new(Pins::new(Arc::clone(words), life, chronicle));
        let ops: Arc<dyn MemOps> = Arc::clone(&pins) as Arc<dyn MemOps>;
        let region = Arc::new(Region::io(region.name(), region.len(), ops));
        Ok(Crystal { inner, region: Some(region), pins })
    }

    /// What acts when the crystal stops and returns.
    pub fn pins(&self) -> Arc<Pins> {
        Arc::clone(&self.pins)
    }
}

impl fmt::Debug for Crystal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Crystal").field("inner", &self.inner).finish_non_exhaustive()
    }
}

impl Device for Crystal {
    fn class(&self) -> &'static DeviceClass {
        self.inner.class()
    }

    fn realize(&self, ctx: &mut RealizeCtx<'_>) -> Result<()> {
        self.inner.realize(ctx)
    }

    fn reset(&self, kind: ResetKind) {
        self.inner.reset(kind);
        self.pins.reset();
    }

    fn region(&self, name: &str) -> Option<RegionRef> {
        if name.is_empty() { self.region.clone() } else { self.inner.region(name) }
    }

    fn export(&self, which: ExportId) -> Option<Export> {
        self.inner.export(which)
    }

    fn sink(&self, port: &str, sources: &[WireId]) -> Option<SinkPin> {
        self.inner.sink(port, sources)
    }

    fn connect(&self, port: &str, source: WireSource) -> Result<()> {
        if port != NMI {
            return self.inner.connect(port, source);
        }
        self.pins.raise(source);
        Ok(())
    }

    fn announce(&self, port: &str) {
        if port != NMI {
            self.inner.announce(port);
        }
    }

    fn event(&self, token: u64, deferred: &mut Deferred) {
        self.inner.event(token, deferred);
    }

    fn is_lazy(&self) -> bool {
        self.inner.is_lazy()
    }

    fn current_tick(&self) -> u64 {
        self.inner.current_tick()
    }

    fn advance_to(&self, tick: u64) {
        self.inner.advance_to(tick);
    }

    fn next_event_tick(&self) -> Option<u64> {
        self.inner.next_event_tick()
    }

    fn attach_lazy(&self, handle: LazyHandle) {
        self.inner.attach_lazy(handle);
    }

    fn attach_clock_control(&self, control: Arc<ClockControl>) {
        self.inner.attach_clock_control(control);
    }
}

impl Instance for Crystal {
    fn bind(&self, ctx: &BindCtx<'_>) -> Result<()> {
        self.inner.bind(ctx)
    }
}
