//! The Cortex-M4 with exact event timing and idle skip: an event loop around rsemu's interpreter.
//!
//! The emulator's own run loop knows the next event of a peripheral only as of the start of a round (1 ms): what
//! firmware arms in the middle of one arrives late, and a sleeping core costs one interpreter step per cycle.
//! This class executes instruction by instruction instead, and between two instructions
//!
//! - publishes its position, so that whatever an instruction touches is at the same instant,
//! - lets the board's [`Actor`]s act at their own instants, in order of time, with the position set back to that
//!   very cycle (a timer input captures the cycle of the edge, not of the instruction that follows),
//! - catches up the stock timers when one of them has an event, also one armed a moment ago,
//! - jumps to the next of all these when the core sleeps, when busy flash stalls it, or when only an interrupt or a
//!   reset can end what it does: locked up, or at a branch to itself,
//! - injects the faults that a scenario orders.
//!
//! It returns early from a round only where the machine has to act between rounds: a change of clock rates and
//! a reset of the whole chip.
//!
//! The loop itself is in `round`; here is what the core consists of, and what stands around it.

mod bare;
mod clocks;
mod device;
mod fast;
mod idle;
mod plant;
mod reset;
mod round;
mod stall;
mod status;
mod step;
mod work;

use crate::crystal;
use crate::incident::Chronicle;
use crate::injection::{Injection, Payload};
use crate::timeline::{Actor, Timeline, lock};
use reset::ResetLine;
use rsemu::core::Result;
use rsemu::core::device::{Device, MachineReset};
use rsemu::core::props::Props;
use rsemu::core::sched::LazyHandle;
use rsemu::core::wire::WireSource;
use rsemu::cpu::arm::v7m::ArmV7m;
use rsemu::dev::stm32::Clocks;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock};
use work::{Timer, Work};

pub use bare::BareCore;
pub(crate) use clocks::rate;
pub(crate) use device::{CLASS_NAME, class, schema};
pub(crate) use stall::BusyFlash;
pub use status::{CpuStats, Fault};

/// "Nothing due".
const NEVER: u64 = u64::MAX;

/// The core.
pub(crate) struct Cpu {
    core: ArmV7m,
    timeline: Arc<Timeline>,
    chronicle: Arc<Chronicle>,
    clocks: OnceLock<Arc<Clocks>>,
    machine_reset: OnceLock<Arc<MachineReset>>,
    reset_line: Arc<ResetLine>,
    /// To the flags of the reset controller, by port.
    flags: Mutex<BTreeMap<&'static str, WireSource>>,
    work: Mutex<Work>,
}

impl Cpu {
    /// A core in its power-on state.
    pub fn new(props: &Props, timeline: Arc<Timeline>, chronicle: Arc<Chronicle>) -> Result<Cpu> {
        Ok(Cpu {
            core: ArmV7m::from_props(props)?,
            timeline,
            chronicle,
            clocks: OnceLock::new(),
            machine_reset: OnceLock::new(),
            reset_line: Arc::new(ResetLine::default()),
            flags: Mutex::new(BTreeMap::new()),
            work: Mutex::new(Work { timer_ticks: (1, 1), ..Work::default() }),
        })
    }

    /// Takes what stands around the core: actors, and the stock timers on the APB1 timer clock.
    pub fn surround(&self, actors: Vec<Arc<dyn Actor>>, timers: Vec<(Arc<dyn Device>, LazyHandle)>) {
        let mut work = lock(&self.work);
        work.actors = actors;
        work.timers = timers.into_iter().map(|(device, handle)| Timer { device, handle, base: 0 }).collect();
    }

    /// Takes the crystal that the core's clock may come from.
    pub fn clock_from(&self, crystal: Arc<crystal::Pins>) {
        lock(&self.work).crystal = Some(crystal);
    }

    /// Takes the flash that the core executes from, and stalls for.
    pub fn execute_from(&self, flash: BusyFlash) {
        lock(&self.work).flash = Some(flash);
    }

    /// Every instruction is left to the emulator from now on.
    pub fn without_fast_path(&self) {
        lock(&self.work).fast.is_off = true;
    }

    /// The supply fails in the middle of this step of the flash, counted from power-up.
    pub fn cut_power_at(&self, step: u64, seed: u64) {
        if let Some(flash) = &mut lock(&self.work).flash {
            flash.cut_at(step, seed);
        }
    }

    /// Plants a fault.
    pub fn order(&self, injection: Injection, payload: Payload) {
        lock(&self.work).planting.add(injection, payload);
    }
}
