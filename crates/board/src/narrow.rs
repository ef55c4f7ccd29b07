//! Lets firmware use a stock peripheral's 32-bit registers as the 16-bit ones they are declared to be.
//!
//! The chip's bus widens an 8 or 16-bit access; the stock watchdog takes 32 bits only and would fault. This
//! adapter passes everything through and widens the register accesses (RM0090 §21.4: "accessed by half-words
//! (16 bits) or words").

use rsemu::core::Result;
use rsemu::core::device::{Deferred, Device, DeviceClass, RealizeCtx, ResetKind, SinkPin};
use rsemu::core::error::BusError;
use rsemu::core::sched::LazyHandle;
use rsemu::core::space::{AccessConstraints, MemAttrs, MemOps, MemResult, Region, RegionKind, RegionRef};
use rsemu::core::value::{Endian, Width};
use rsemu::core::wire::{WireId, WireSource};
use rsemu::machine::{BindCtx, Instance};
use std::sync::Arc;

/// A peripheral seen through 16-bit glasses.
#[derive(Debug)]
pub(crate) struct Narrow {
    inner: Arc<dyn Instance>,
    region: Option<RegionRef>,
}

impl Narrow {
    /// Wraps `inner`.
    pub fn new(inner: Arc<dyn Instance>) -> Narrow {
        let region = inner.region("").map(|region| match region.kind() {
            RegionKind::Io(words) => {
                let ops: Arc<dyn MemOps> = Arc::new(Widened(Arc::clone(words)));
                Arc::new(Region::io(region.name(), region.len(), ops))
            }
            _ => region,
        });
        Narrow { inner, region }
    }
}

/// 32-bit registers that take 16-bit accesses.
#[derive(Debug)]
struct Widened(Arc<dyn MemOps>);

impl MemOps for Widened {
    fn read(&self, offset: u64, dst: &mut [u8], attrs: MemAttrs) -> MemResult {
        let mut word = [0; 4];
        self.0.read(offset & !3, &mut word, attrs)?;
        let bytes = word.get((offset & 3) as usize..).ok_or(BusError::BadAccess)?;
        for (dst, byte) in dst.iter_mut().zip(bytes) {
            *dst = *byte;
        }
        Ok(())
    }

    fn write(&self, offset: u64, src: &[u8], attrs: MemAttrs) -> MemResult {
        if offset & 3 != 0 {
            return Err(BusError::BadAccess);
        }
        let mut word = [0; 4];
        for (byte, src) in word.iter_mut().zip(src) {
            *byte = *src;
        }
        self.0.write(offset, &word, attrs)
    }

    fn constraints(&self) -> AccessConstraints {
        AccessConstraints::word(Width::U32, Endian::Little).with_widths(Width::U16, Width::U32)
    }
}

impl Device for Narrow {
    fn class(&self) -> &'static DeviceClass {
        self.inner.class()
    }

    fn realize(&self, ctx: &mut RealizeCtx<'_>) -> Result<()> {
        self.inner.realize(ctx)
    }

    fn reset(&self, kind: ResetKind) {
        self.inner.reset(kind);
    }

    fn debug_halt(&self, halted: bool) {
        self.inner.debug_halt(halted);
    }

    fn region(&self, name: &str) -> Option<RegionRef> {
        if name.is_empty() { self.region.clone() } else { self.inner.region(name) }
    }

    fn sink(&self, port: &str, sources: &[WireId]) -> Option<SinkPin> {
        self.inner.sink(port, sources)
    }

    fn connect(&self, port: &str, source: WireSource) -> Result<()> {
        self.inner.connect(port, source)
    }

    fn announce(&self, port: &str) {
        self.inner.announce(port);
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
}

impl Instance for Narrow {
    fn bind(&self, ctx: &BindCtx<'_>) -> Result<()> {
        self.inner.bind(ctx)
    }
}
