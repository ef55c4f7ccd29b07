//! The Cortex-M4 with exact event timing and idle skip: a clockwork around rsemu's interpreter.
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
//! - plants the faults that a scenario wants.
//!
//! It returns early from a round only where the machine has to act between rounds: a change of clock rates and
//! a reset of the whole chip.

mod device;
mod idle;
mod plant;
mod stall;
mod step;

use crate::crystal;
use crate::incident::{Chronicle, Event, ResetCause};
use crate::plant::{Bait, Plant};
use crate::timeline::{Actor, Rate, Timeline, lock};
use clino_sim::node::Ns;
use device::ResetLine;
use idle::Idle;
use plant::Planting;
use rsemu::core::Result;
use rsemu::core::device::{Device, MachineReset};
use rsemu::core::props::Props;
use rsemu::core::sched::{AccessKind, LazyHandle, TickCursor};
use rsemu::core::sync::Ordering;
use rsemu::core::wire::{Level, WireSource};
use rsemu::cpu::arm::v7m::ArmV7m;
use rsemu::cpu::arm::v7m::sys::Exception;
use rsemu::dev::stm32::{ClockOutput, Clocks};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock};
use step::step;

pub(crate) use device::{CLASS_NAME, class, schema};
pub(crate) use stall::BusyFlash;

/// Instructions between two looks at what firmware can change without telling: timers, clock tree, reset
/// request, sleep. A timer event armed less than this many instructions ahead may arrive that much late.
const LOOK_EVERY: u32 = 8;

/// "Nothing due".
const NEVER: u64 = u64::MAX;

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

/// A stock timer whose events the core must not run past.
struct Timer {
    device: Arc<dyn Device>,
    handle: LazyHandle,
    /// Its tick at the start of the round.
    base: u64,
}

/// What one round of execution works on.
#[derive(Default)]
struct Work {
    /// Cycles executed beyond the last budget.
    debt: u64,
    /// Generation of the clock tree the timeline follows.
    generation: Option<u64>,
    /// Ticks of the APB1 timer clock per core cycle, as a fraction.
    timer_ticks: (u64, u64),
    /// A core cycle at which a tick of the timer clock begins.
    in_phase: u64,
    actors: Vec<Arc<dyn Actor>>,
    /// Instant of the last act: time does not go back.
    acted: Ns,
    timers: Vec<Timer>,
    flash: Option<BusyFlash>,
    crystal: Option<Arc<crystal::Pins>>,
    planting: Planting,
    /// Program counter at the last look.
    seen_pc: u32,
    /// The core was seen locked up since the last reset.
    locked_up: bool,
    stats: CpuStats,
}

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

    /// The supply fails in the middle of this step of the flash, counted from power-up.
    pub fn cut_power_at(&self, step: u64, seed: u64) {
        if let Some(flash) = &mut lock(&self.work).flash {
            flash.cut_at(step, seed);
        }
    }

    /// Whether it has failed.
    pub fn is_without_power(&self) -> bool {
        lock(&self.work).is_without_power()
    }

    /// Plants a fault.
    pub fn order(&self, plant: Plant, bait: Bait) {
        lock(&self.work).planting.add(plant, bait);
    }

    /// Whether the watchdog has bitten, and the core has not looked yet.
    pub fn is_about_to_be_reset(&self) -> bool {
        self.reset_line.asserted.load(Ordering::Relaxed)
    }

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

    /// Runs at most `budget` cycles; returns how many are to be accounted for.
    fn run_round(&self, work: &mut Work, cursor: &TickCursor, budget: u64) -> u64 {
        let anchor = cursor.anchor();
        let mut at = anchor + work.debt;
        self.follow_clocks(work, anchor);
        let budget = work.whole_timer_ticks(anchor, budget);
        let end = anchor + budget;
        for timer in &mut work.timers {
            timer.base = timer.handle.present_tick();
        }
        let mut acting = self.next_act(work, at);
        let mut timing = work.next_timer_event(anchor);
        let mut planting = self.next_planting(work);
        let mut until_look = LOOK_EVERY;
        let mut idle = Idle::No;

        if work.is_without_power() {
            return budget;
        }
        while at < end {
            if at >= acting {
                self.let_act(work, cursor, at);
                acting = self.next_act(work, at);
                timing = work.next_timer_event(anchor);
            }
            cursor.set(at);
            if at >= timing {
                for timer in &work.timers {
                    // A busy slot would mean that this very timer is being advanced further up: it is not.
                    let _ = timer.handle.sync(AccessKind::Guest);
                }
                timing = work.next_timer_event(anchor);
            }
            if until_look == LOOK_EVERY
                && let Some(until) = self.stalled_until(work, at)
            {
                // One cycle at least, in case an event lies where the core stands.
                at += self.stall(work, at, until.min(end).min(acting).min(timing).max(at + 1));
                timing = work.next_timer_event(anchor);
                if self.must_leave(work, at) {
                    break;
                }
                continue;
            }
            if until_look == LOOK_EVERY && work.is_without_clock() {
                let until = end.min(acting).min(timing).max(at + 1);
                work.stats.stalled_cycles += until - at;
                at = until;
                if self.must_leave(work, at) {
                    break;
                }
                continue;
            }
            if at >= planting && self.plant(work, at) {
                planting = self.next_planting(work);
            }
            let cycles = step(&self.core);
            if cycles == 0 {
                break;
            }
            at += cycles;
            work.count(idle, cycles);
            work.stats.instructions += u64::from(idle != Idle::Asleep);
            if self.timeline.take_nudge() {
                acting = self.next_act(work, at);
            }
            until_look -= 1;
            if until_look > 0 && idle == Idle::No {
                continue;
            }
            until_look = LOOK_EVERY;
            let sp = self.core.msp();
            work.stats.lowest_sp = Some(work.stats.lowest_sp.map_or(sp, |lowest| lowest.min(sp)));
            timing = work.next_timer_event(anchor);
            if self.must_leave(work, at) {
                break;
            }
            let next = end.min(acting).min(timing).min(if planting > at { planting } else { NEVER });
            // Idle after a step that began idle: nothing was pending, so nothing can happen before the next event.
            // (The WFI itself proves nothing: it may fall through at once.)
            let now = self.idleness(work, at);
            if now == idle {
                let skipped = match idle {
                    Idle::No => 0,
                    Idle::Asleep | Idle::Stuck => self.sleep_until(at, next),
                };
                at += skipped;
                work.count(idle, skipped);
            }
            idle = now;
        }
        // What is due within this round must not find the timers at its end already.
        let seam = at.min(end);
        self.let_act(work, cursor, seam);
        cursor.set(seam);
        let spent = at - anchor;
        work.debt = spent.saturating_sub(budget);
        spent.min(budget)
    }

    /// Takes over a new clock tree, in force from core cycle `cycle` on.
    fn follow_clocks(&self, work: &mut Work, cycle: u64) {
        let Some(clocks) = self.clocks.get() else { return };
        let generation = clocks.generation();
        if work.generation == Some(generation) {
            return;
        }
        work.generation = Some(generation);
        let hclk = rate(clocks, ClockOutput::HCLK);
        let timer = rate(clocks, ClockOutput::TIMCLK1);
        work.timer_ticks = reduced(timer.num * hclk.den, timer.den * hclk.num);
        work.in_phase = cycle;
        self.timeline.rerate(cycle, hclk);
        let now = self.timeline.ns_at(cycle);
        for actor in &work.actors {
            actor.clocks_changed(now);
        }
    }

    /// First cycle at or after the next actor's instant.
    fn next_act(&self, work: &Work, at: u64) -> u64 {
        let next = work.actors.iter().filter_map(|actor| actor.next_event()).min();
        next.map_or(NEVER, |ns| self.timeline.cycle_from(ns).max(at))
    }

    /// Lets every actor act that is due by cycle `at`, earliest first, each at its own instant.
    fn let_act(&self, work: &mut Work, cursor: &TickCursor, at: u64) {
        let limit = self.timeline.ns_at(at);
        let began = cursor.get();
        loop {
            let due = work.actors.iter().filter_map(|actor| actor.next_event().map(|ns| (ns, actor)));
            let Some((ns, actor)) = due.min_by_key(|(ns, _)| *ns) else { break };
            let now = ns.max(work.acted);
            if now > limit {
                break;
            }
            cursor.set(self.timeline.cycle_at(now).max(began));
            actor.act(now);
            // An actor that does not move on must not stop the clock.
            let stuck = actor.next_event().is_some_and(|next| next <= now);
            work.acted = if stuck { now + 1 } else { now };
        }
    }

    /// The whole chip is to be reset, for another cause than the watchdog.
    fn reset_from(&self, cause: ResetCause) {
        if let Some(line) = lock(&self.flags).get(device::flag(cause)) {
            line.pulse(Level::High);
        }
        *lock(&self.reset_line.cause) = Some(cause);
        self.reset_line.asserted.store(true, Ordering::Relaxed);
    }

    /// Whether the machine has something to do between rounds.
    fn must_leave(&self, work: &mut Work, at: u64) -> bool {
        if self.clocks.get().is_some_and(|clocks| Some(clocks.generation()) != work.generation) {
            return true;
        }
        let software = self.core.reset_requested();
        if software {
            self.core.clear_reset_request();
            self.reset_from(ResetCause::Software);
        }
        if !self.reset_line.asserted.swap(false, Ordering::Relaxed) {
            return false;
        }
        work.stats.resets += 1;
        let now = self.timeline.ns_at(at);
        // Nobody says so but the watchdog's line.
        let cause = lock(&self.reset_line.cause).take().unwrap_or(ResetCause::Watchdog);
        self.chronicle.note(now, Event::Reset(cause));
        work.planting.reset(now);
        work.locked_up = false;
        for actor in &work.actors {
            actor.resetting();
        }
        if let Some(reset) = self.machine_reset.get() {
            reset.request();
        }
        true
    }
}

impl Work {
    fn count(&mut self, idle: Idle, cycles: u64) {
        match idle {
            Idle::Asleep => self.stats.asleep_cycles += cycles,
            Idle::No | Idle::Stuck => self.stats.awake_cycles += cycles,
        }
    }

    /// Whether the supply has failed.
    fn is_without_power(&self) -> bool {
        self.flash.as_ref().is_some_and(BusyFlash::is_without_power)
    }

    /// Whether the core's clock has stopped.
    fn is_without_clock(&self) -> bool {
        self.crystal.as_ref().is_some_and(|crystal| crystal.is_halted())
    }

    /// The part of `budget` after which a tick of the timer clock begins.
    ///
    /// The emulator counts ticks from the beginning of the round; begun within a tick, all that follows would be
    /// one tick early. What is left out here is made up for in the next round.
    fn whole_timer_ticks(&self, anchor: u64, budget: u64) -> u64 {
        let cycles_per_tick = (self.timer_ticks.1 / self.timer_ticks.0.max(1)).max(1);
        budget.saturating_sub((anchor + budget - self.in_phase) % cycles_per_tick)
    }

    /// Core cycle of the next timer event, given that the round began at cycle `anchor`.
    fn next_timer_event(&self, anchor: u64) -> u64 {
        let (num, den) = self.timer_ticks;
        let ahead = |timer: &Timer| {
            let ticks = timer.device.next_event_tick()?.saturating_sub(timer.base);
            // Asked every few instructions: one tick is a whole number of cycles but for a moment at the start.
            let cycles = match num {
                1 => ticks.saturating_mul(den),
                _ => {
                    let cycles = (u128::from(ticks) * u128::from(den)).div_ceil(u128::from(num.max(1)));
                    u64::try_from(cycles).unwrap_or(NEVER)
                }
            };
            Some(anchor.saturating_add(cycles))
        };
        self.timers.iter().filter_map(ahead).min().unwrap_or(NEVER)
    }
}

/// The same fraction with the smallest numbers.
fn reduced(num: u64, den: u64) -> (u64, u64) {
    let (mut a, mut b) = (num, den);
    while b != 0 {
        (a, b) = (b, a % b);
    }
    (num / a.max(1), den / a.max(1))
}

/// An output of the clock tree as a fraction of hertz.
pub(crate) fn rate(clocks: &Clocks, output: ClockOutput) -> Rate {
    let rate = clocks.rate(output);
    Rate { num: rate.num(), den: rate.den() }
}
