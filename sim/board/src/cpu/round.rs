//! One round of execution: as much of the machine's time as the scheduler hands out at once.

use rsemu::core::sched::{AccessKind, TickCursor};

use super::fast::{Course, Stretch};
use super::idle::Idle;
use super::step::step;
use super::work::Work;
use super::{Cpu, NEVER};

/// Instructions between two looks at what firmware can change without telling: timers, clock tree, reset
/// request, sleep. A timer event armed less than this many instructions ahead may arrive that much late.
const LOOK_EVERY: u32 = 8;

/// When the next look is due, and whether it can see anything new.
struct Looks {
    /// Instructions up to the next one.
    left: u32,
    /// Where the emulator's devices stood at the last one, if nothing but the fast path has run since.
    stood: Option<u64>,
}

impl Cpu {
    /// Runs at most `budget` cycles; returns how many are to be accounted for.
    pub(super) fn run_round(&self, work: &mut Work, cursor: &TickCursor, budget: u64) -> u64 {
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
        let mut planting = self.next_planting(&work.planting);
        let mut looks = Looks { left: LOOK_EVERY, stood: None };
        let mut idle = Idle::No;

        if work.is_without_power() {
            return budget;
        }
        while at < end {
            if at >= acting {
                self.let_act(work, cursor, at);
                acting = self.next_act(work, at);
                timing = work.next_timer_event(anchor);
                looks.stood = None;
            }
            cursor.set(at);
            if at >= timing {
                for timer in &work.timers {
                    // A busy slot would mean that this very timer is being advanced further up: it is not.
                    let _ = timer.handle.sync(AccessKind::Guest);
                }
                timing = work.next_timer_event(anchor);
                looks.stood = None;
            }
            if looks.left == LOOK_EVERY
                && let Some(flash) = &mut work.flash
                && let Some(until) = self.stalled_until(flash, &mut work.stats, at)
            {
                // One cycle at least, in case an event lies where the core stands.
                at += self.stall(&mut work.stats, at, until.min(end).min(acting).min(timing).max(at + 1));
                timing = work.next_timer_event(anchor);
                looks.stood = None;
                if self.must_leave(work, at) {
                    break;
                }
                continue;
            }
            if looks.left == LOOK_EVERY && work.is_without_clock() {
                let until = end.min(acting).min(timing).max(at + 1);
                work.stats.stalled_cycles += until - at;
                at = until;
                looks.stood = None;
                if self.must_leave(work, at) {
                    break;
                }
                continue;
            }
            if at >= planting && self.plant(&mut work.planting, at) {
                planting = self.next_planting(&work.planting);
            }
            let limit = end.min(acting).min(timing).min(planting);
            let run = if idle == Idle::No && at < limit {
                self.run_fast(work, cursor, &mut looks, at, limit)
            } else {
                Stretch::default()
            };
            if run.instructions > 0 {
                at += run.cycles;
                work.count(idle, run.cycles);
                work.stats.instructions += run.instructions;
            } else {
                let cycles = step(&self.core);
                if cycles == 0 {
                    break;
                }
                at += cycles;
                work.count(idle, cycles);
                work.stats.instructions += u64::from(idle != Idle::Asleep);
                looks.left -= 1;
                looks.stood = None;
            }
            if self.timeline.take_nudge() {
                acting = self.next_act(work, at);
            }
            if looks.left > 0 && idle == Idle::No {
                continue;
            }
            looks = Looks { left: LOOK_EVERY, stood: work.devices_stand_at() };
            work.stats.note_sp(self.core.msp());
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

    /// Executes from `at` what the fast path can, up to a look that may see something new, or `limit`.
    fn run_fast(
        &self,
        work: &mut Work,
        cursor: &TickCursor,
        looks: &mut Looks,
        at: u64,
        limit: u64,
    ) -> Stretch {
        let Work { fast, flash, seen_pc, stats, .. } = work;
        let Some(flash) = flash else { return Stretch::default() };
        let course = Course { cursor, at, limit, devices: flash.device() };
        let looked = looks.stood == Some(course.devices.current_tick());
        // An actor that asks to be looked at is, after one instruction.
        let nudged = self.timeline.is_nudged();
        fast.run(&self.core, &course, |sp, pc| {
            looks.left -= 1;
            if looks.left > 0 {
                return !nudged;
            }
            if !looked || *seen_pc == pc {
                return false;
            }
            // Nothing has changed since the last look: this is what remains of it.
            looks.left = LOOK_EVERY;
            *seen_pc = pc;
            stats.note_sp(sp);
            !nudged
        })
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
    fn must_leave(&self, work: &mut Work, at: u64) -> bool {
        self.is_clocked_anew(work) || self.hands_on_reset(work, at)
    }
}
