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
//! - jumps to the next of all these when the core sleeps.
//!
//! It returns early from a round only where the machine has to act between rounds: a change of clock rates and
//! a reset of the whole chip.

use crate::timeline::{Actor, Rate, Timeline, lock};
use clino_sim::node::Ns;
use rsemu::core::Result;
use rsemu::core::device::{
    Device, DeviceClass, ExportId, MachineReset, RealizeCtx, ResetKind, SinkPin,
};
use rsemu::core::props::Props;
use rsemu::core::space::MemAttrs;
use rsemu::core::sched::{AccessKind, Budget, Consumed, LazyHandle, TickCursor};
use rsemu::core::sync::{AtomicBool, Ordering};
use rsemu::core::value::Width;
use rsemu::core::wire::{Level, WireId, WireSink, WireSource};
use rsemu::cpu::arm::v7m::sys::Exception;
use rsemu::cpu::arm::v7m::{self, ArmV7m, xpsr};
use rsemu::dev::stm32::{ClockOutput, Clocks};
use rsemu::machine::validate::{ClassSchema, PortDir};
use rsemu::machine::{BindCtx, Instance};
use std::sync::{Arc, Mutex, OnceLock};

/// Class name in the board text.
pub(crate) const CLASS_NAME: &str = "clino.cortex-m4f";

/// Instructions between two looks at what firmware can change without telling: timers, clock tree, reset
/// request, sleep. A timer event armed less than this many instructions ahead may arrive that much late.
const LOOK_EVERY: u32 = 8;

/// Where an exception frame holds the program status (ARM DDI 0403 B1.5.6).
const STACKED_XPSR: u64 = 28;
/// Bit of EXC_RETURN: the frame is on the process stack (ARM DDI 0403 B1.5.8).
const EXC_RETURN_SPSEL: u32 = 1 << 2;

/// "Nothing due".
const NEVER: u64 = u64::MAX;

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
    schema.port("sysresetreq", PortDir::Out)
}

/// What the core has done since power-up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CpuStats {
    /// Instructions executed.
    pub instructions: u64,
    /// Core cycles spent executing.
    pub awake_cycles: u64,
    /// Core cycles spent in WFI or WFE.
    pub asleep_cycles: u64,
    /// Resets of the whole chip after power-up: watchdog or software.
    pub resets: u64,
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
    actors: Vec<Arc<dyn Actor>>,
    /// Instant of the last act: time does not go back.
    acted: Ns,
    timers: Vec<Timer>,
    stats: CpuStats,
}

/// The core.
pub(crate) struct Cpu {
    core: ArmV7m,
    timeline: Arc<Timeline>,
    clocks: OnceLock<Arc<Clocks>>,
    machine_reset: OnceLock<Arc<MachineReset>>,
    reset_line: Arc<ResetLine>,
    sysresetreq: Mutex<Option<WireSource>>,
    work: Mutex<Work>,
}

impl Cpu {
    /// A core in its power-on state.
    pub fn new(props: &Props, timeline: Arc<Timeline>) -> Result<Cpu> {
        Ok(Cpu {
            core: ArmV7m::from_props(props)?,
            timeline,
            clocks: OnceLock::new(),
            machine_reset: OnceLock::new(),
            reset_line: Arc::new(ResetLine { asserted: AtomicBool::new(false) }),
            sysresetreq: Mutex::new(None),
            work: Mutex::new(Work { timer_ticks: (1, 1), ..Work::default() }),
        })
    }

    /// Takes what stands around the core: actors, and the stock timers on the APB1 timer clock.
    pub fn surround(&self, actors: Vec<Arc<dyn Actor>>, timers: Vec<(Arc<dyn Device>, LazyHandle)>) {
        let mut work = lock(&self.work);
        work.actors = actors;
        work.timers = timers.into_iter().map(|(device, handle)| Timer { device, handle, base: 0 }).collect();
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
        let end = anchor + budget;
        let mut at = anchor + work.debt;
        self.follow_clocks(work, at);
        for timer in &mut work.timers {
            timer.base = timer.handle.present_tick();
        }
        let mut acting = self.next_act(work, at);
        let mut timing = work.next_timer_event(anchor);
        let mut until_look = LOOK_EVERY;
        let mut dozing = false;

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
            let cycles = self.step();
            if cycles == 0 {
                break;
            }
            at += cycles;
            if dozing {
                work.stats.asleep_cycles += cycles;
            } else {
                work.stats.instructions += 1;
                work.stats.awake_cycles += cycles;
            }
            if self.timeline.take_nudge() {
                acting = self.next_act(work, at);
            }
            until_look -= 1;
            if until_look > 0 && !dozing {
                continue;
            }
            until_look = LOOK_EVERY;
            timing = work.next_timer_event(anchor);
            if self.must_leave(work) {
                break;
            }
            // Asleep after a step that began asleep: nothing was pending, so nothing can happen before the next
            // event. (The WFI itself proves nothing: it may fall through at once.)
            let asleep = self.core.is_asleep();
            if asleep && dozing {
                let skipped = self.sleep_until(at, end.min(acting).min(timing));
                at += skipped;
                work.stats.asleep_cycles += skipped;
            }
            dozing = asleep;
        }
        cursor.set(at);
        let spent = at - anchor;
        work.debt = spent.saturating_sub(budget);
        spent.min(budget)
    }

    /// One step of the core: an instruction, an exception entry, or a cycle asleep.
    ///
    /// The emulator's exception entry stacks the program status without the bits that say how far an IT block
    /// has come (ARM DDI 0403 B1.5.6 wants them), so an interrupted block would go on unconditionally. They are
    /// put into the frame here.
    fn step(&self) -> u64 {
        let before = self.core.regs().xpsr;
        let cycles = self.core.step();
        if before & xpsr::IT_MASK != 0 {
            let after = self.core.regs();
            if (before ^ after.xpsr) & xpsr::EXCEPTION != 0
                && let Some(space) = self.core.space()
            {
                let from_process_stack = after.r[14] & EXC_RETURN_SPSEL != 0;
                let frame = if from_process_stack { after.psp } else { after.msp };
                let stacked = u64::from(frame) + STACKED_XPSR;
                let word = space.read(stacked, Width::U32, MemAttrs::DEBUG).unwrap_or_default() as u32;
                let whole = u64::from(word | before & xpsr::IT_MASK);
                // The frame was written a moment ago; the same address cannot be refused now.
                let _ = space.write(stacked, Width::U32, whole, MemAttrs::DEBUG);
            }
        }
        cycles
    }

    /// Takes over a new clock tree.
    fn follow_clocks(&self, work: &mut Work, cycle: u64) {
        let Some(clocks) = self.clocks.get() else { return };
        let generation = clocks.generation();
        if work.generation == Some(generation) {
            return;
        }
        work.generation = Some(generation);
        let hclk = rate(clocks, ClockOutput::HCLK);
        let timer = rate(clocks, ClockOutput::TIMCLK1);
        work.timer_ticks = (timer.num * hclk.den, timer.den * hclk.num);
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

    /// Whether the machine has something to do between rounds.
    fn must_leave(&self, work: &mut Work) -> bool {
        if self.clocks.get().is_some_and(|clocks| Some(clocks.generation()) != work.generation) {
            return true;
        }
        if self.core.reset_requested() {
            self.core.clear_reset_request();
            if let Some(line) = &*lock(&self.sysresetreq) {
                line.pulse(Level::High);
            }
            self.reset_line.asserted.store(true, Ordering::Relaxed);
        }
        if !self.reset_line.asserted.swap(false, Ordering::Relaxed) {
            return false;
        }
        work.stats.resets += 1;
        for actor in &work.actors {
            actor.resetting();
        }
        if let Some(reset) = self.machine_reset.get() {
            reset.request();
        }
        true
    }

    /// Lets a sleeping core sleep up to `until`; returns the cycles skipped.
    fn sleep_until(&self, at: u64, until: u64) -> u64 {
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

impl Work {
    /// Core cycle of the next timer event, given that the round began at cycle `anchor`.
    fn next_timer_event(&self, anchor: u64) -> u64 {
        let (num, den) = self.timer_ticks;
        let ahead = |timer: &Timer| {
            let ticks = timer.device.next_event_tick()?.saturating_sub(timer.base);
            let cycles = (u128::from(ticks) * u128::from(den)).div_ceil(u128::from(num.max(1)));
            Some(anchor.saturating_add(u64::try_from(cycles).unwrap_or(NEVER)))
        };
        self.timers.iter().filter_map(ahead).min().unwrap_or(NEVER)
    }
}

/// An output of the clock tree as a fraction of hertz.
pub(crate) fn rate(clocks: &Clocks, output: ClockOutput) -> Rate {
    let rate = clocks.rate(output);
    Rate { num: rate.num(), den: rate.den() }
}

/// The line that resets the whole chip: the watchdog's.
struct ResetLine {
    asserted: AtomicBool,
}

impl WireSink for ResetLine {
    fn set_level(&self, _src: WireId, _line: u32, level: Level) {
        if level.is_high() {
            self.asserted.store(true, Ordering::Relaxed);
        }
    }
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
        self.core.sink(port, sources)
    }

    fn connect(&self, port: &str, source: WireSource) -> Result<()> {
        if port != "sysresetreq" {
            return self.core.connect(port, source);
        }
        *lock(&self.sysresetreq) = Some(source);
        Ok(())
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
