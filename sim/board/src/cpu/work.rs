//! The state that the core keeps from one round of execution to the next.

use std::sync::Arc;

use clino_sim::node::Ns;
use rsemu::core::device::Device;
use rsemu::core::sched::LazyHandle;

use super::fast::Fast;
use super::plant::Planting;
use super::{BusyFlash, CpuStats};
use crate::crystal;
use crate::timeline::Actor;

/// A stock timer whose events the core must not run past.
pub(super) struct Timer {
    pub device: Arc<dyn Device>,
    pub handle: LazyHandle,
    /// Its tick at the start of the round.
    pub base: u64,
}

/// What one round of execution works on.
#[derive(Default)]
pub(super) struct Work {
    /// Cycles executed beyond the last budget.
    pub debt: u64,
    /// Generation of the clock tree the timeline follows.
    pub generation: Option<u64>,
    /// Ticks of the APB1 timer clock per core cycle, as a fraction.
    pub timer_ticks: (u64, u64),
    /// A core cycle at which a tick of the timer clock begins.
    pub in_phase: u64,
    pub actors: Vec<Arc<dyn Actor>>,
    /// Instant of the last act: time does not go back.
    pub acted: Ns,
    pub timers: Vec<Timer>,
    pub flash: Option<BusyFlash>,
    pub crystal: Option<Arc<crystal::Pins>>,
    pub planting: Planting,
    pub fast: Fast,
    /// Program counter at the last look.
    pub seen_pc: u32,
    /// The core was seen locked up since the last reset.
    pub locked_up: bool,
    pub stats: CpuStats,
}

impl Work {
    /// Where the emulator's devices stand: it is another number once they have been caught up.
    pub fn devices_stand_at(&self) -> Option<u64> {
        self.flash.as_ref().map(|flash| flash.device().current_tick())
    }

    /// Whether the supply has failed.
    pub fn is_without_power(&self) -> bool {
        self.flash.as_ref().is_some_and(BusyFlash::is_without_power)
    }

    /// Whether the core's clock has stopped.
    pub fn is_without_clock(&self) -> bool {
        self.crystal.as_ref().is_some_and(|crystal| crystal.is_halted())
    }
}
