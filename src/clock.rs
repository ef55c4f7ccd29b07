//! Time: microseconds since reset, and an alarm for each level that has deadlines.
//!
//! TIM4 counts microseconds; its 16 bits come round every 65.5 ms, and an interrupt counts the rounds in 64
//! bits. A compare channel each is the alarm of the bus level and of the Modbus level.

use core::cell::{Cell, RefCell};

use clino_bus::Micros;
use cortex_m::peripheral::DWT;
use critical_section::{CriticalSection, Mutex};
use stm32f4xx_hal::pac::{self, interrupt};
use stm32f4xx_hal::rcc::{BusTimerClock, Enable, Rcc, Reset};

use crate::params::{CLOCK_HZ, CORE_HZ};
use crate::shared;

/// Microseconds in one round of the counter.
const ROUND: u64 = 1 << 16;

static TIMER: Mutex<RefCell<Option<pac::TIM4>>> = Mutex::new(RefCell::new(None));
static ROUNDS: Mutex<Cell<u64>> = Mutex::new(Cell::new(0));

/// Starts the clock at zero.
pub fn start(timer: pac::TIM4, rcc: &mut Rcc) {
    pac::TIM4::enable(rcc);
    pac::TIM4::reset(rcc);
    let divider = pac::TIM4::timer_clock(&rcc.clocks).raw() / CLOCK_HZ;
    timer.psc().write(|w| w.psc().set((divider - 1) as u16));
    timer.arr().write(|w| w.arr().set(u16::MAX));
    // The prescaler takes effect at an update; with URS set, this one raises no flag.
    timer.cr1().write(|w| w.urs().set_bit());
    timer.egr().write(|w| w.ug().set_bit());
    timer.dier().write(|w| w.uie().set_bit());
    timer.cr1().write(|w| w.urs().set_bit().cen().set_bit());
    critical_section::with(|cs| TIMER.replace(cs, Some(timer)));
}

/// Now.
pub fn now() -> Micros {
    critical_section::with(|cs| TIMER.borrow_ref(cs).as_ref().map_or(Micros::ZERO, |timer| read(timer, cs)))
}

/// Does something that stalls the core, interrupts included, maybe for more than a round of the counter: of the rounds that
/// end meanwhile one is counted, and the others here. The core's cycle counter, which goes on, tells how many.
///
/// Limit: 25 s, in which the cycle counter comes round.
pub fn across_stall<R>(work: impl FnOnce() -> R) -> R {
    let (cycles, begin) = critical_section::with(|_| (DWT::cycle_count(), now()));
    let result = work();
    critical_section::with(|cs| {
        let passed = u64::from(DWT::cycle_count().wrapping_sub(cycles) / (CORE_HZ / CLOCK_HZ));
        let lost = (passed + ROUND / 2).saturating_sub(now().since(begin).0) / ROUND;
        ROUNDS.borrow(cs).set(ROUNDS.borrow(cs).get() + lost);
    });
    result
}

/// Whom an alarm wakes.
#[derive(Clone, Copy)]
pub enum Level {
    /// The bus level.
    Bus,
    /// The Modbus level.
    Modbus,
}

impl Level {
    const ALL: [Level; 2] = [Level::Bus, Level::Modbus];

    /// Number of the compare channel, less one.
    const fn channel(self) -> u8 {
        self as u8
    }

    fn wake(self) {
        match self {
            Level::Bus => crate::bus::wake(),
            Level::Modbus => crate::modbus::wake(),
        }
    }
}

/// Wakes a level at `at`, or at the end of the round if that comes first: rounds wake it anyway.
/// An instant that has passed wakes it at once.
pub fn wake_at(level: Level, at: Micros) {
    let channel = level.channel();
    let missed = critical_section::with(|cs| {
        let timer = TIMER.borrow_ref(cs);
        let Some(timer) = timer.as_ref() else { return false };
        if at.since(read(timer, cs)).0 >= ROUND {
            timer.dier().modify(|_, w| w.ccie(channel).clear_bit());
            return false;
        }
        timer.ccr(channel.into()).write(|w| w.ccr().set(at.0 as u16));
        timer.sr().write(|w| w.ccif(channel).clear_bit());
        timer.dier().modify(|_, w| w.ccie(channel).set_bit());
        // The counter may have passed the compare value before the write took effect.
        read(timer, cs) >= at
    });
    if missed {
        level.wake();
    }
}

fn read(timer: &pac::TIM4, cs: CriticalSection<'_>) -> Micros {
    let rounds = ROUNDS.borrow(cs).get();
    let count = u64::from(timer.cnt().read().cnt().bits());
    // An overflow whose interrupt has not run yet: count it here, if the counter was read after it.
    let overflowed = timer.sr().read().uif().bit_is_set();
    let count_after = u64::from(timer.cnt().read().cnt().bits());
    match overflowed {
        true => Micros((rounds + 1) * ROUND + count_after),
        false => Micros(rounds * ROUND + count),
    }
}

#[interrupt]
fn TIM4() {
    critical_section::with(|cs| {
        let timer = TIMER.borrow_ref(cs);
        let Some(timer) = timer.as_ref() else { return };
        let (status, armed) = (timer.sr().read(), timer.dier().read());
        let round = status.uif().bit_is_set();
        if round {
            ROUNDS.borrow(cs).set(ROUNDS.borrow(cs).get() + 1);
            // Only what was seen is cleared, so that nothing is lost that comes up meanwhile.
            timer.sr().write(|w| w.uif().clear_bit());
            // The people level looks at the time, too.
            shared::note_work();
        }
        for level in Level::ALL {
            let channel = level.channel();
            let rings = status.ccif(channel).bit_is_set() && armed.ccie(channel).bit_is_set();
            if rings {
                timer.sr().write(|w| w.ccif(channel).clear_bit());
                timer.dier().modify(|_, w| w.ccie(channel).clear_bit());
            }
            if rings || round {
                level.wake();
            }
        }
    });
}
