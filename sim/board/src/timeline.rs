//! Virtual time: from the core's cycle counter to nanoseconds, and the next act of each actor.
//!
//! Everything on the board that is not part of the chip's stock model (USARTs, PWM sources) keeps its time in
//! nanoseconds since power-up. The core counts cycles of a clock that firmware re-rates at run time, so the
//! timeline is a chain of straight lines: each new HCLK starts one at the point the last one reached. There is
//! exactly one time base; the emulator's scheduler follows the same cycles.

use clino_sim::node::Ns;
use rsemu::core::sched::TickCursor;
use rsemu::core::sync::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

/// Picoseconds in a second.
pub(crate) const PS_PER_S: u128 = 1_000_000_000_000;
/// Picoseconds in a nanosecond.
pub(crate) const PS_PER_NS: u64 = 1_000;

/// A part of the board that acts at its own instants.
pub(crate) trait Actor: Send + Sync {
    /// Earliest instant at which [`Actor::act`] wants to be called.
    fn next_event(&self) -> Option<Ns>;

    /// Does everything that is due up to and including `now`.
    fn act(&self, now: Ns);

    /// A bus clock changed.
    fn clocks_changed(&self, _now: Ns) {}

    /// The chip is about to be reset.
    fn resetting(&self) {}
}

/// A clock rate as an exact fraction of hertz.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Rate {
    pub num: u64,
    pub den: u64,
}

impl Rate {
    /// Length of `ticks` ticks in picoseconds, rounded to the nearest; 0 when the clock stands.
    pub fn ps(self, ticks: u64) -> u64 {
        if self.num == 0 {
            return 0;
        }
        let (num, den) = (u128::from(self.num), u128::from(self.den));
        ((u128::from(ticks) * PS_PER_S * den + num / 2) / num) as u64
    }
}

/// A stretch of time with one core clock.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    /// Core cycle at which it begins.
    cycle: u64,
    /// The same instant in picoseconds since power-up.
    ps: u128,
    /// Core clock.
    hclk: Rate,
}

/// The board's clock, shared by the core and everything around it.
#[derive(Debug)]
pub(crate) struct Timeline {
    /// The core's position, published before each instruction.
    cursor: OnceLock<TickCursor>,
    stretch: Mutex<Stretch>,
    /// An actor's next event may have moved forward.
    nudged: AtomicBool,
}

impl Timeline {
    /// A clock at zero; it runs once the core has a cursor and a rate.
    pub fn new() -> Timeline {
        Timeline {
            cursor: OnceLock::new(),
            stretch: Mutex::new(Stretch { cycle: 0, ps: 0, hclk: Rate { num: 1, den: 1 } }),
            nudged: AtomicBool::new(false),
        }
    }

    /// Keeps the cursor in which the core publishes its position.
    pub fn follow(&self, cursor: TickCursor) {
        let _ = self.cursor.set(cursor);
    }

    /// The core's cursor, if the machine has handed one out.
    pub fn cursor(&self) -> Option<&TickCursor> {
        self.cursor.get()
    }

    /// From core cycle `cycle` on the core runs at `hclk`.
    pub fn rerate(&self, cycle: u64, hclk: Rate) {
        let mut stretch = lock(&self.stretch);
        *stretch = Stretch { cycle, ps: stretch.ps_at(cycle), hclk };
    }

    /// The instant of core cycle `cycle`.
    pub fn ns_at(&self, cycle: u64) -> Ns {
        (lock(&self.stretch).ps_at(cycle) / u128::from(PS_PER_NS)) as Ns
    }

    /// First core cycle that begins at or after `ns`.
    pub fn cycle_from(&self, ns: Ns) -> u64 {
        lock(&self.stretch).cycles_until(ns, true)
    }

    /// Last core cycle that begins at or before `ns`.
    pub fn cycle_at(&self, ns: Ns) -> u64 {
        lock(&self.stretch).cycles_until(ns, false)
    }

    /// The instant at which the instruction in progress began.
    pub fn now(&self) -> Ns {
        self.cursor.get().map_or(0, |cursor| self.ns_at(cursor.get()))
    }

    /// Makes the core check again which actor acts next.
    pub fn nudge(&self) {
        self.nudged.store(true, Ordering::Relaxed);
    }

    /// Whether [`Timeline::nudge`] was called since the last [`Timeline::take_nudge`].
    pub fn is_nudged(&self) -> bool {
        self.nudged.load(Ordering::Relaxed)
    }

    /// Whether [`Timeline::nudge`] was called since the last call.
    pub fn take_nudge(&self) -> bool {
        self.is_nudged() && self.nudged.swap(false, Ordering::Relaxed)
    }
}

impl Stretch {
    fn ps_at(&self, cycle: u64) -> u128 {
        let cycles = u128::from(cycle.saturating_sub(self.cycle));
        self.ps + cycles * PS_PER_S * u128::from(self.hclk.den) / u128::from(self.hclk.num)
    }

    fn cycles_until(&self, ns: Ns, up: bool) -> u64 {
        let ahead = (u128::from(ns) * u128::from(PS_PER_NS)).saturating_sub(self.ps);
        let scaled = ahead * u128::from(self.hclk.num);
        let per = PS_PER_S * u128::from(self.hclk.den);
        let cycles = if up { scaled.div_ceil(per) } else { scaled / per };
        self.cycle + cycles as u64
    }
}

/// Locks, whatever happened to the last holder: a panicking test must not hide behind a second panic.
pub(crate) fn lock<T: ?Sized>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HSI: Rate = Rate { num: 16_000_000, den: 1 };
    const PLL: Rate = Rate { num: 168_000_000, den: 1 };

    #[test]
    fn a_change_of_clock_keeps_the_time_it_happened_at() {
        let line = Timeline::new();
        line.rerate(0, HSI);
        assert_eq!(line.ns_at(1_600), 100_000);
        line.rerate(1_600, PLL);
        assert_eq!(line.ns_at(1_600), 100_000);
        assert_eq!(line.ns_at(1_600 + 168), 101_000);
    }

    #[test]
    fn cycles_bracket_an_instant_between_two_of_them() {
        let line = Timeline::new();
        line.rerate(0, PLL);
        // 1 µs + 1 ns lies 0.168 cycles after cycle 168.
        assert_eq!((line.cycle_at(1_001), line.cycle_from(1_001)), (168, 169));
        assert_eq!((line.cycle_at(1_000), line.cycle_from(1_000)), (168, 168));
        assert!(line.ns_at(line.cycle_from(1_001)) >= 1_001);
    }

    #[test]
    fn a_tick_is_rounded_to_the_nearest_picosecond() {
        // 42 MHz / 0x16d: 8.690476 µs per bit (RM0090 table 142, 115200 Bd).
        assert_eq!(Rate { num: 42_000_000, den: 1 }.ps(0x16d), 8_690_476);
        assert_eq!(Rate { num: 0, den: 1 }.ps(1), 0);
    }
}
