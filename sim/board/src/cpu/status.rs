//! The core as seen from outside: counters, place, and the fault that it is in.

use rsemu::core::sync::Ordering;
use rsemu::cpu::arm::v7m::sys::Exception;

use super::Cpu;
use crate::timeline::lock;

/// What the core has done since power-up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CpuStats {
    /// Instructions executed.
    pub instructions: u64,
    /// Core cycles spent executing.
    pub awake_cycles: u64,
    /// Core cycles spent in WFI or WFE.
    pub asleep_cycles: u64,
    /// Core cycles spent waiting for flash that was programmed or erased, or for a crystal that has stopped.
    pub stalled_cycles: u64,
    /// Words of flash programmed, and sectors erased.
    pub flash_steps: u64,
    /// Resets of the whole chip after power-up: watchdog or software.
    pub resets: u64,
    /// Lowest main stack pointer seen, looked at every few instructions.
    pub lowest_sp: Option<u32>,
}

impl CpuStats {
    /// The stack pointer was seen at `sp`.
    pub(super) fn note_sp(&mut self, sp: u32) {
        self.lowest_sp = Some(self.lowest_sp.map_or(sp, |lowest| lowest.min(sp)));
    }
}

/// What is known of a core that stopped in a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Exception number of the handler: 3 HardFault, 4 MemManage, 5 BusFault, 6 UsageFault.
    pub exception: u16,
    /// Nothing can be executed any more: a fault within a fault.
    pub lockup: bool,
    /// Program counter at the time of the look; within the handler unless locked up.
    pub pc: u32,
    /// Top of the exception frame's stack: where the stacked registers lie.
    pub sp: u32,
    /// Configurable fault status register.
    pub cfsr: u32,
    /// HardFault status register.
    pub hfsr: u32,
    /// Address of a precise bus fault, if CFSR says so.
    pub bfar: u32,
}

impl Cpu {
    /// Counters since power-up.
    pub fn stats(&self) -> CpuStats {
        lock(&self.work).stats
    }

    /// The fault the core is in, if any.
    pub fn fault(&self) -> Option<Fault> {
        let exception = self.core.current_exception().0;
        let lockup = self.core.is_locked_up();
        if !lockup && !(Exception::HARD_FAULT.0..=Exception::USAGE_FAULT.0).contains(&exception) {
            return None;
        }
        let (cfsr, hfsr, bfar) = self.core.with_sys(|sys| (sys.cfsr, sys.hfsr, sys.bfar));
        Some(Fault { exception, lockup, pc: self.core.pc(), sp: self.core.msp(), cfsr, hfsr, bfar })
    }

    /// Program counter.
    pub fn pc(&self) -> u32 {
        self.core.pc()
    }

    /// Whether the supply has failed.
    pub fn is_without_power(&self) -> bool {
        lock(&self.work).is_without_power()
    }

    /// Whether the watchdog has bitten, and the core has not looked yet.
    pub fn is_about_to_be_reset(&self) -> bool {
        self.reset_line.asserted.load(Ordering::Relaxed)
    }
}
