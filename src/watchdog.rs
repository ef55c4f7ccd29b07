//! The watchdog: fed at one place, and only while every task goes on.
//!
//! A tick of its own timer (SysTick, above every other interrupt) looks at the tasks every 10 ms. If all have checked in
//! within their own deadlines it feeds the independent watchdog; if one has not, it notes which, and where the program is,
//! and starts again at once. If even the tick does not come, because interrupts are held off or the core is locked up,
//! the watchdog runs out.
//!
//! | hang | ends after |
//! |---|---|
//! | a task of the buses, of the PWM inputs, of Modbus | 0.5 s and two ticks |
//! | the console or storing | 0.9 s and two ticks |
//! | everything | 0.53 to 1.48 s, as its oscillator runs at 47 to 17 kHz |
//! | everything, before [`start()`] has set the time | 0.35 to 0.96 s |
//!
//! It runs from the first instructions after a reset on (`pre_init.rs`), with the time that it has at reset:
//! divider 4, 4096 counts. [`start()`] sets its time. A time that was set counts from the next feed on (section 21.3), and takes
//! up to five cycles of the oscillator to be taken over, during which a feed loads the old one and a further write is
//! ignored (section 21.4.4): `start` waits for that and feeds. Then nothing feeds until the first tick: bringing the board up
//! takes 30 ms, and a hang in it ends like any other.
//!
//! The longest time without a tick that is no hang is that of a sector being erased: 0.5 s, begun right after a feed
//! ([`look`]). It fits before the watchdog's shortest time, and the tick after it fits as well.
//!
//! Source: RM0090 section 21 (IWDG), DS8626 table 40 (erase) and table 41 (LSI: 17, 32, 47 kHz), PM0214 section 4.5 (SysTick).

use core::arch::naked_asm;

use clino_recovery::{Crash, Mode, MonitoredTask, TICK_MS, TaskMonitor};

use crate::board::Watchdog;
use crate::faults::Frame;
use crate::{board, params, start};

/// Cycles of the watchdog's oscillator for each of its counts: prescaler 16.
const PRESCALER: u32 = 16;
/// What PR holds for that.
const PRESCALER_CODE: u16 = 0b010;
/// Slowest and fastest oscillator, Hz (DS8626 table 41).
const LSI_HZ: (u32, u32) = (17_000, 47_000);
/// Longest time from a feed to the reset, in milliseconds: the documented limit is 1500.
const LONGEST_MS: u32 = 1_480;
/// Longest erase of a sector of 16 KiB, in milliseconds (DS8626 table 40).
const ERASE_MS: u32 = 500;
/// Counts: as many as the slowest oscillator can make in the longest time.
const COUNTS: u32 = LSI_HZ.0 * LONGEST_MS / 1_000 / PRESCALER;
/// The same for the fastest, in milliseconds.
const SHORTEST_MS: u32 = COUNTS * PRESCALER * 1_000 / LSI_HZ.1;
const _: () = assert!(SHORTEST_MS >= ERASE_MS + 2 * TICK_MS, "a legal erase would run into the watchdog");
/// How long setting it may take, in milliseconds: five cycles of the slowest oscillator are 0.3 ms.
const LONGEST_UPDATE_MS: u32 = 10;
const _: () = assert!(COUNTS <= 0x1000, "RLR has twelve bits");

/// Keys to be written to KR (RM0090 section 21.4.1). `pre_init.rs` has its own [`START`].
const UNLOCK: u16 = 0x5555;
const START: u16 = 0xCCCC;

/// Cycles of the core from one tick to the next. SysTick has 24 bits.
const TICK_CYCLES: u32 = params::CORE_HZ / 1_000 * TICK_MS;
const _: () = assert!(TICK_CYCLES <= 1 << 24);

static MONITOR: TaskMonitor = TaskMonitor::new();

/// Sets the watchdog's time. Until [`begin`] nothing feeds it after that.
pub fn start(iwdg: &Watchdog) {
    iwdg.stop_with_core();
    // It runs already, unless a debugger has begun elsewhere.
    board::tell_watchdog(START);
    wait_for_update(iwdg);
    // The counts first, and fed: the divider acts at once, the counts from the next feed on. The other way round, a hang
    // between the two would last for 4096 counts of the long divider.
    board::tell_watchdog(UNLOCK);
    iwdg.rlr().write(|w| w.rl().set((COUNTS - 1) as u16));
    wait_for_update(iwdg);
    feed();
    board::tell_watchdog(UNLOCK);
    // SAFETY: a divider of the manual.
    iwdg.pr().write(|w| unsafe { w.bits(PRESCALER_CODE) });
    wait_for_update(iwdg);
    feed();
}

/// Waits until what was set has been taken over, but not for ever: each later feed loads what has been by then.
fn wait_for_update(iwdg: &Watchdog) {
    let begin = board::cycles();
    let limit = params::INTERNAL_HZ / 1_000 * LONGEST_UPDATE_MS;
    while board::cycles().wrapping_sub(begin) < limit {
        let status = iwdg.sr().read();
        if status.pvu().bit_is_clear() && status.rvu().bit_is_clear() {
            return;
        }
    }
}

/// From here on every monitored task of this mode is expected to check in.
pub fn begin(core: cortex_m::Peripherals, mode: Mode) {
    let tasks: &[MonitoredTask] = match mode {
        Mode::Normal => &[
            MonitoredTask::T7Bus,
            #[cfg(feature = "isu")]
            MonitoredTask::IsuBus,
            #[cfg(feature = "pwm")]
            MonitoredTask::Pwm,
            #[cfg(feature = "modbus")]
            MonitoredTask::Modbus,
            MonitoredTask::Console,
        ],
        Mode::Safe | Mode::Bare => &[
            #[cfg(feature = "modbus")]
            MonitoredTask::Modbus,
            MonitoredTask::Console,
        ],
    };
    tasks.iter().for_each(|task| check_in(*task));
    board::start_tick(core, TICK_CYCLES);
}

/// The task goes on.
pub fn check_in(task: MonitoredTask) {
    MONITOR.check_in(task);
}

/// The task has nothing to do until it checks in again.
pub fn rest(task: MonitoredTask) {
    MONITOR.rest(task);
}

/// Feeds the watchdog, if all tasks are in time: before something that keeps the tick away.
pub fn look() {
    if MONITOR.stalled().is_none() {
        feed();
    }
}

/// The one place that feeds, but for the refusal of the wrong chip.
fn feed() {
    board::tell_watchdog(board::FEED);
}

/// The watchdog's tick.
///
/// # Safety
/// The core calls it.
// SAFETY: the name is that of the vector.
#[unsafe(naked)]
#[unsafe(no_mangle)]
unsafe extern "C" fn SysTick() {
    naked_asm!("mrs r0, msp", "b {tick}", tick = sym tick)
}

/// A tick, above every other level. `frame` is what the core has put on the stack.
extern "C" fn tick(frame: *const Frame) {
    start::keep_uptime();
    match MONITOR.tick() {
        None => feed(),
        Some(task) => start::crash(&Crash::stalled(task, Frame::registers(frame))),
    }
}
