//! Time: microseconds since reset, and an alarm for each level that has deadlines.
//!
//! Its timer counts microseconds; its 16 bits come round every 65.5 ms, and an interrupt counts the rounds in 64
//! bits. A compare channel each is the alarm of the bus level and of the Modbus level.
//!
//! Reading the time takes no lock: a read that the end of a round interrupts is repeated.

use core::sync::atomic::{AtomicU32, Ordering, compiler_fence};

use clino_bus::{Duration, Instant};
use stm32f4xx_hal::rcc::{BusTimerClock, Rcc};

use crate::board::{self, ClockTimer};
use crate::params::{CLOCK_HZ, CORE_HZ};

/// Microseconds in one round of the counter.
const ROUND: u64 = 1 << 16;
const ROUND_LASTS: Duration = Duration::from_micros(ROUND as u32);

/// The lower half of the count of rounds, which changes with each.
static ROUNDS: AtomicU32 = AtomicU32::new(0);
/// The upper half.
static ROUNDS_ABOVE: AtomicU32 = AtomicU32::new(0);

/// Adds to the count of rounds. Must not interrupt itself: called by the interrupt, and with interrupts masked.
fn count(rounds: u64) {
    let (above, below) = (ROUNDS_ABOVE.load(Ordering::Relaxed), ROUNDS.load(Ordering::Relaxed));
    let before = u64::from(above) << 32 | u64::from(below);
    let after = before.wrapping_add(rounds);
    ROUNDS_ABOVE.store((after >> 32) as u32, Ordering::Relaxed);
    ROUNDS.store(after as u32, Ordering::Relaxed);
}

/// Now.
pub fn now() -> Instant {
    // SAFETY: reading these registers changes nothing.
    let timer = unsafe { &*ClockTimer::ptr() };
    loop {
        let rounds = ROUNDS.load(Ordering::Relaxed);
        let above = ROUNDS_ABOVE.load(Ordering::Relaxed);
        compiler_fence(Ordering::SeqCst);
        let count = timer.cnt().read().cnt().bits();
        // An overflow whose interrupt has not run yet: count it here, if the counter was read after it.
        let overflowed = timer.sr().read().uif().bit_is_set();
        let count_after = timer.cnt().read().cnt().bits();
        compiler_fence(Ordering::SeqCst);
        // The interrupt that counts runs as a whole: it was here between the two looks, or not.
        if ROUNDS.load(Ordering::Relaxed) == rounds {
            let rounds = u64::from(above) << 32 | u64::from(rounds);
            return match overflowed {
                true => Instant::from_micros((rounds + 1) * ROUND + u64::from(count_after)),
                false => Instant::from_micros(rounds * ROUND + u64::from(count)),
            };
        }
    }
}

/// Does something that stalls the core, interrupts included, maybe for more than a round of the counter: of the rounds
/// that end meanwhile one is counted, and the others here. The core's cycle counter, which goes on, tells how many.
///
/// Limit: 25 s, in which the cycle counter comes round.
pub fn across_stall<R>(work: impl FnOnce() -> R) -> R {
    let (cycles, begin) = critical_section::with(|_| (board::cycles(), now()));
    let result = work();
    critical_section::with(|_| {
        let passed = u64::from(board::cycles().wrapping_sub(cycles) / (CORE_HZ / CLOCK_HZ));
        count((passed + ROUND / 2).saturating_sub(now().micros_since(begin)) / ROUND);
    });
    result
}

/// The alarms.
#[derive(Clone, Copy)]
pub enum Alarm {
    /// The bus level.
    Bus,
    /// The Modbus level.
    Modbus,
}

impl Alarm {
    /// Number of the compare channel, less one.
    const fn channel(self) -> u8 {
        self as u8
    }
}

/// What the timer's interrupt has found.
pub struct Rung {
    /// A round has ended.
    pub round: bool,
    /// The alarm of the bus level.
    pub bus: bool,
    /// That of the Modbus level.
    pub modbus: bool,
}

/// The timer, for the alarms.
pub struct Timer(ClockTimer);

impl Timer {
    /// Starts the clock at zero.
    pub fn start(timer: ClockTimer, rcc: &mut Rcc) -> Timer {
        board::switch_on::<ClockTimer>(rcc);
        let divider = ClockTimer::timer_clock(&rcc.clocks).raw() / CLOCK_HZ;
        timer.psc().write(|w| w.psc().set((divider - 1) as u16));
        timer.arr().write(|w| w.arr().set(u16::MAX));
        // The prescaler takes effect at an update; with URS set, this one raises no flag.
        timer.cr1().write(|w| w.urs().set_bit());
        timer.egr().write(|w| w.ug().set_bit());
        timer.dier().write(|w| w.uie().set_bit());
        timer.cr1().write(|w| w.urs().set_bit().cen().set_bit());
        Timer(timer)
    }

    /// Sets an alarm to `at`, or to the end of the round if that comes first: a round wakes both levels anyway. `seen` is
    /// the time at which this run of the level began; a round that has ended since wakes it again. Returns whether the
    /// instant has passed already.
    pub fn set(&mut self, alarm: Alarm, at: Instant, seen: Instant) -> bool {
        let (timer, channel) = (&self.0, alarm.channel());
        if at.since(seen) >= ROUND_LASTS {
            timer.dier().modify(|_, w| w.ccie(channel).clear_bit());
            return false;
        }
        timer.ccr(channel.into()).write(|w| w.ccr().set(at.as_micros() as u16));
        timer.sr().write(|w| w.ccif(channel).clear_bit());
        timer.dier().modify(|_, w| w.ccie(channel).set_bit());
        // The counter may have passed the compare value before the write took effect.
        now() >= at
    }

    /// The timer's interrupt.
    pub fn on_interrupt(&mut self) -> Rung {
        let timer = &self.0;
        let (status, armed) = (timer.sr().read(), timer.dier().read());
        let round = status.uif().bit_is_set();
        if round {
            // Only what was seen is cleared, so that nothing is lost that comes up meanwhile. No level above this
            // interrupt reads the clock, so that none sees the time between the two.
            timer.sr().write(|w| w.uif().clear_bit());
            count(1);
        }
        let rung = |alarm: Alarm| {
            let channel = alarm.channel();
            let rings = status.ccif(channel).bit_is_set() && armed.ccie(channel).bit_is_set();
            if rings {
                timer.sr().write(|w| w.ccif(channel).clear_bit());
                timer.dier().modify(|_, w| w.ccie(channel).clear_bit());
            }
            rings
        };
        Rung { round, bus: rung(Alarm::Bus), modbus: rung(Alarm::Modbus) }
    }
}
