//! Busy flash stalls the core.
//!
//! The F407 has one bank: while a word is programmed or a sector erased, no instruction can be fetched (RM0090 section
//! 3.6: reading flash that is being written or erased stalls the bus). The stock controller only says that it is busy.
//! Here the core stands still until it is done: no instruction and no interrupt; peripherals and time go on.
//!
//! Not modelled: what the caches would still feed to the core, and that code in RAM would go on; the gateway has none. Up
//! to eight instructions are executed before the stall is noticed.

use super::Cpu;
use super::status::CpuStats;
use crate::flash::{self, Sectors};
use clino_sim::node::Ns;
use rsemu::core::device::Device;
use rsemu::core::sched::{AccessKind, LazyHandle};
use rsemu::cpu::arm::v7m::sys::Exception;
use std::sync::Arc;

/// Bit of SYST_CSR: the wrap raises the exception.
pub(super) const SYSTICK_INTERRUPT: u32 = 1 << 1;

/// The flash controller, as the core feels it. Its clock ticks once a nanosecond.
pub(crate) struct BusyFlash {
    device: Arc<dyn Device>,
    handle: LazyHandle,
    /// End of the step in progress, in its own ticks.
    ends: Option<u64>,
    cut: Cut,
}

/// When the supply fails.
#[derive(Clone, Copy, Debug, Default)]
enum Cut {
    #[default]
    Never,
    /// In this step; what it leaves behind follows from the seed.
    At { step: u64, seed: u64 },
    /// It has failed.
    Done,
}

impl BusyFlash {
    pub fn new(device: Arc<dyn Device>, handle: LazyHandle) -> BusyFlash {
        BusyFlash { device, handle, ends: None, cut: Cut::Never }
    }

    /// The supply fails in the middle of this step, counted from power-up, the first being 1.
    pub fn cut_at(&mut self, step: u64, seed: u64) {
        self.cut = Cut::At { step, seed };
    }

    /// The controller: its clock moves on whenever the emulator catches up its devices, be it by a single cycle.
    pub fn device(&self) -> &dyn Device {
        &*self.device
    }

    /// Whether the supply has failed.
    pub fn is_without_power(&self) -> bool {
        matches!(self.cut, Cut::Done)
    }

    /// Its next event, if it is busy, after it was brought up to the core's instant.
    fn busy_until(&mut self) -> Option<u64> {
        self.device.next_event_tick()?;
        // A busy slot would mean that this very device is being advanced further up: it is not.
        let _ = self.handle.sync(AccessKind::Guest);
        self.device.next_event_tick()
    }
}

impl Cpu {
    /// The cycle up to which flash stalls the core, if it does. Counts the steps that begin.
    pub(super) fn stalled_until(&self, flash: &mut BusyFlash, stats: &mut CpuStats, at: u64) -> Option<u64> {
        let Some(ends) = flash.busy_until() else {
            flash.ends = None;
            return None;
        };
        if flash.ends.replace(ends) != Some(ends) {
            stats.flash_steps += 1;
            match flash.cut {
                Cut::At { step, seed } if step == stats.flash_steps => {
                    flash.cut = Cut::Done;
                    self.tear(flash, ends, seed);
                }
                _ => {}
            }
        }
        let left: Ns = ends.saturating_sub(flash.device.current_tick());
        Some(self.timeline.cycle_from(self.timeline.ns_at(at) + left + 1))
    }

    /// Leaves behind what a step leaves that does not come to its end.
    fn tear(&self, flash: &BusyFlash, ends: u64, seed: u64) {
        let Some(space) = self.core.space() else { return };
        let before = Sectors::read(&space);
        flash.device.advance_to(ends);
        let after = Sectors::read(&space);
        flash::torn(&before, &after, seed).write(&space);
    }

    /// Lets time pass without the core; returns the cycles.
    pub(super) fn stall(&self, stats: &mut CpuStats, at: u64, until: u64) -> u64 {
        let cycles = until - at;
        stats.stalled_cycles += cycles;
        self.core.with_sys(|sys| {
            if sys.tick_systick(cycles) && sys.syst_csr & SYSTICK_INTERRUPT != 0 {
                sys.set_pending(Exception::SYSTICK, true);
            }
            sys.tick_cyccnt(cycles);
        });
        cycles
    }
}
