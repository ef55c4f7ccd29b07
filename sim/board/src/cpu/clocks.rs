//! The clocks that the core's cycles are counted against: the clock tree, and the timers on the APB1 timer clock.

use rsemu::dev::stm32::{ClockOutput, Clocks};

use super::work::{Timer, Work};
use super::{Cpu, NEVER};
use crate::timeline::Rate;

impl Cpu {
    /// Takes over a new clock tree, in force from core cycle `cycle` on.
    pub(super) fn follow_clocks(&self, work: &mut Work, cycle: u64) {
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

    /// Whether firmware has changed the clock tree since it was taken over.
    pub(super) fn is_clocked_anew(&self, work: &Work) -> bool {
        self.clocks.get().is_some_and(|clocks| Some(clocks.generation()) != work.generation)
    }
}

impl Work {
    /// The part of `budget` after which a tick of the timer clock begins.
    ///
    /// The emulator counts ticks from the beginning of the round; begun within a tick, all that follows would be
    /// one tick early. What is left out here is made up for in the next round.
    pub fn whole_timer_ticks(&self, anchor: u64, budget: u64) -> u64 {
        let cycles_per_tick = (self.timer_ticks.1 / self.timer_ticks.0.max(1)).max(1);
        budget.saturating_sub((anchor + budget - self.in_phase) % cycles_per_tick)
    }

    /// Core cycle of the next timer event, given that the round began at cycle `anchor`.
    pub fn next_timer_event(&self, anchor: u64) -> u64 {
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
