//! A core that only waits: asleep, locked up, or at a branch to itself.
//!
//! What it would do step by step is skipped up to the next event.

use rsemu::core::space::MemAttrs;
use rsemu::core::value::Width;

use super::Cpu;
use super::work::Work;
use crate::incident::Event;

/// A branch to itself (ARM DDI 0403 A7.7.12).
const BRANCH_TO_SELF: u64 = 0xe7fe;

/// Whether the next step will be the same as the last.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Idle {
    /// It will not.
    No,
    /// In WFI or WFE.
    Asleep,
    /// Locked up, or at a branch to itself.
    Stuck,
}

impl Work {
    /// Counts cycles that the core has spent like this.
    pub fn count(&mut self, idle: Idle, cycles: u64) {
        match idle {
            Idle::Asleep => self.stats.asleep_cycles += cycles,
            Idle::No | Idle::Stuck => self.stats.awake_cycles += cycles,
        }
    }
}

impl Cpu {
    /// What the core is doing after a step.
    pub(super) fn idleness(&self, work: &mut Work, at: u64) -> Idle {
        if self.core.is_asleep() {
            return Idle::Asleep;
        }
        let pc = self.core.pc();
        if std::mem::replace(&mut work.seen_pc, pc) != pc {
            return Idle::No;
        }
        if self.core.is_locked_up() {
            if !std::mem::replace(&mut work.locked_up, true) {
                self.chronicle.note(self.timeline.ns_at(at), Event::Lockup);
            }
            return Idle::Stuck;
        }
        let instruction = self
            .core
            .space()
            .map(|space| space.read(u64::from(pc), Width::U16, MemAttrs::DEBUG).unwrap_or_default());
        if instruction == Some(BRANCH_TO_SELF) { Idle::Stuck } else { Idle::No }
    }

    /// Lets a sleeping core sleep up to `until`; returns the cycles skipped.
    pub(super) fn sleep_until(&self, at: u64, until: u64) -> u64 {
        self.core.with_sys(|sys| {
            let mut cycles = until.saturating_sub(at);
            if sys.syst_csr & 1 != 0 && sys.syst_rvr != 0 {
                // SysTick's own wrap is left to an ordinary step, which pends the exception.
                cycles = cycles.min(u64::from(sys.syst_cvr & 0x00ff_ffff).saturating_sub(1));
            }
            sys.tick_systick(cycles);
            sys.tick_cyccnt(cycles);
            cycles
        })
    }
}
