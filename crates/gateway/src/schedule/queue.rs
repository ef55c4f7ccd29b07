//! Which slot of a bus is asked next, and when: earliest deadline first.
//!
//! *Deadlines.* A period begins where the last one was due to begin, however late it was asked: no drift. A period that the
//! bus had no time for is left out and counted (`Turn::book_next`). An ISU is due when it has something new, which is no
//! fixed period (`refresh.rs`). A retry goes first; a value that has to be confirmed (`slot/plausibility.rs`) is due [`CONFIRM_AFTER`] it
//! came, if not sooner.
//!
//! *Dead nodes.* A node that has not answered [`DEAD_AFTER`] readings in a row, and not for [`GONE_AFTER`], is taken for
//! dead. Dead nodes are probed one after another, without retries, each after a pause that grows by a [part](PAUSE_GROWS) with every probe, up to
//! [`LONGEST_PAUSE_MS`]: exponential back-off. Together they get one part of the bus ([`Queue::new`]), however many there
//! are, and the time in which nobody else is due; the others keep the rest. A node that is back is found within 2 s.
//!
//! *Faulty bus.* While nobody on a bus answers (`outage.rs`), nobody is dead: each slot is asked once in its period, or as
//! often as the bus can, without retries. So the first node that answers again does so within one cycle, the time that the
//! bus needs to ask all its slots once; and then all are due at once. What was heard before confirms nothing.
//!
//! *Deaf nodes* are given a silence, in which they come to (`silence.rs`).
//!
//! *Time.* Looking through all slots takes longer than the bus should wait between two exchanges. So it is done while an
//! answer is awaited ([`Queue::look_ahead`]), and again only if that exchange does not end well.

use clino_bus::{Duration, Instant};

use super::Polled;
use super::silence::Silence;
use crate::bits::Bits;
use crate::trace::Purpose;

/// A value that has to be confirmed is asked for again after this. What has damaged the first answer is over then: twenty
/// milliseconds are two periods of the mains' harmonics, and the exchanges of several other nodes.
pub(crate) const CONFIRM_AFTER: Duration = Duration::from_millis(20);
/// Readings in a row without any answer after which a node is taken for dead.
const DEAD_AFTER: u8 = 3;
/// A node that has answered within this time is not dead, but has perhaps taken noise for the beginning of a long
/// command: it then takes what is asked for the rest of that, and the more often it is asked the sooner it is back.
const GONE_AFTER: Duration = Duration::from_millis(1_000);
/// A pause between two probes of a node grows by one part in so many, and by a millisecond.
const PAUSE_GROWS: u16 = 16;
/// The longest pause. What is left of 2 s is for the other dead nodes.
const LONGEST_PAUSE_MS: u16 = 1_200;
/// Nothing will be to be asked.
const NEVER: Instant = Instant::NEVER;

/// The exchange in hand.
#[derive(Clone, Copy)]
pub(crate) struct Asked {
    pub slot: usize,
    pub since: Instant,
    pub purpose: Purpose,
    /// Our last stop bit.
    pub released: Instant,
    /// Characters of the answer after the first.
    pub rest_characters: u32,
}

pub(crate) struct Queue {
    /// The slots of this bus.
    mine: Bits,
    asked: Option<Asked>,
    /// Who is next if the exchange in hand ends well.
    ahead: Option<usize>,
    /// Dead nodes together get one part in so many of the bus.
    probe_share: u32,
    silence: Silence,
    /// Nobody on the bus answers.
    faulty: bool,
    /// Something was wrong with the line since the bus is faulty.
    troubled: bool,
    /// Who was dead before that.
    gone: Bits,
    /// No dead node is asked before this, unless nobody else is due.
    probe_at: Instant,
    /// What the last probe took.
    probe_took: Duration,
    /// Nothing is to be asked before this. Found by looking through all slots, which is not done for every character
    /// that comes in.
    idle_until: Instant,
}

impl Queue {
    /// The queue of no slot. Dead nodes together get one part in `probe_share` of the bus; after a silence of
    /// `silence` all nodes hear again, whatever they have taken for a request.
    #[inline(always)]
    pub fn new(probe_share: u32, silence: Duration) -> Self {
        Queue {
            silence: Silence::new(silence),
            faulty: false,
            troubled: false,
            gone: Bits::EMPTY,
            mine: Bits::EMPTY,
            asked: None,
            ahead: None,
            probe_share,
            probe_at: Instant::ZERO,
            probe_took: Duration::ZERO,
            idle_until: Instant::ZERO,
        }
    }

    /// The slot means something else now: what is still to come for it is nobody's.
    pub fn forget(&mut self, slot: usize, is_mine: bool) {
        self.mine.set(slot, is_mine);
        self.asked.take_if(|asked| asked.slot == slot);
        self.ahead = None;
        self.silence.forget(slot);
        self.gone.set(slot, false);
        self.look_again();
    }

    /// Something has happened that may change what is to be asked, and when.
    pub fn look_again(&mut self) {
        self.idle_until = Instant::ZERO;
    }

    /// When something is to be asked, if ever.
    pub fn poll_at(&self) -> Option<Instant> {
        (self.idle_until != NEVER).then_some(self.idle_until)
    }

    /// The slot to be asked now, if there is one. `ask_at` says when the master can ask for a slot.
    pub fn next(
        &mut self,
        now: Instant,
        slots: &[Polled],
        ask_at: &dyn Fn(&Polled) -> Option<Instant>,
    ) -> Option<usize> {
        let silent_until = self.silence.keep(now);
        if now < silent_until {
            self.idle_until = silent_until;
        }
        if now < self.idle_until {
            return None;
        }
        let ahead = self.ahead.take().filter(|&index| {
            slots.get(index).is_some_and(|polled| {
                self.free(polled, now) <= now && ask_at(polled).is_some_and(|ask_at| ask_at <= now)
            })
        });
        if ahead.is_some() {
            return ahead;
        }
        let (at, index) = self.soonest(now, slots, ask_at).unwrap_or((NEVER, 0));
        self.idle_until = at;
        (at <= now).then_some(index)
    }

    /// A slot is being asked.
    pub fn begin(&mut self, asked: Asked) {
        self.silence.asked(asked.slot);
        self.asked = Some(asked);
        self.look_again();
    }

    /// The exchange in hand has ended.
    pub fn end(&mut self) -> Option<Asked> {
        self.look_again();
        self.asked.take()
    }

    /// The exchange in hand has not ended well: who is next has to be found again.
    pub fn end_badly(&mut self) -> Option<Asked> {
        self.ahead = None;
        self.end()
    }

    /// Our last stop bit was out at `at`; there is time to see who is next.
    pub fn look_ahead(&mut self, at: Instant, slots: &[Polled]) {
        let Some(asked) = &mut self.asked else { return };
        asked.released = at;
        let in_hand = asked.slot;
        let mut ahead: Option<(Instant, usize)> = None;
        for (index, polled) in self.mine(slots) {
            // What the slot in hand is due for besides its next reading, the exchange in hand will tell.
            let due = if index == in_hand { polled.turn.due } else { polled.due(CONFIRM_AFTER, at) };
            let free = match polled.turn.dead {
                true if index == in_hand => NEVER,
                true => due.max(self.probe_at),
                false => due,
            };
            if free <= at && ahead.is_none_or(|(earliest, _)| due < earliest) {
                ahead = Some((due, index));
            }
        }
        self.ahead = ahead.map(|(_, index)| index);
    }

    /// The slot that may be asked first, and when; of those that may be asked now, the one that is due for longest.
    fn soonest(
        &self,
        now: Instant,
        slots: &[Polled],
        ask_at: &dyn Fn(&Polled) -> Option<Instant>,
    ) -> Option<(Instant, usize)> {
        let mut soonest: Option<(Instant, Instant, usize)> = None;
        let mut next_living = NEVER;
        for dead in [false, true] {
            for (index, polled) in self.mine(slots).filter(|(_, polled)| polled.turn.dead == dead) {
                let due = polled.due(CONFIRM_AFTER, now);
                let disturbs = due.max(now) + self.probe_took > next_living;
                let free = if dead && disturbs { due.max(self.probe_at) } else { due };
                let beaten =
                    |at| soonest.is_some_and(|(other_at, other_due, _)| (other_at, other_due) <= (at, due));
                // The master is asked only about those that would be first if it had nothing against it.
                if !beaten(free.max(now))
                    && let Some(at) = ask_at(polled).map(|ask_at| free.max(ask_at).max(now))
                    && !beaten(at)
                {
                    soonest = Some((at, due, index));
                }
            }
            next_living = soonest.map_or(NEVER, |(at, _, _)| at);
        }
        soonest.map(|(at, _, index)| (at, index))
    }

    fn mine<'a>(&self, slots: &'a [Polled]) -> impl Iterator<Item = (usize, &'a Polled)> {
        self.mine.iter().filter_map(|index| Some((index, slots.get(index)?)))
    }

    /// When the slot may be asked: when it is due, and there is time for dead nodes if it is one.
    fn free(&self, polled: &Polled, now: Instant) -> Instant {
        if polled.turn.dead {
            polled.due(CONFIRM_AFTER, now).max(self.probe_at)
        } else {
            polled.due(CONFIRM_AFTER, now)
        }
    }

    /// The slots of this bus that are not taken for dead.
    #[inline(never)]
    pub fn living(&self, slots: &[Polled]) -> Bits {
        let mut living = self.mine;
        self.mine(slots)
            .filter(|(_, polled)| polled.turn.dead)
            .for_each(|(index, _)| living.set(index, false));
        living
    }

    /// Whether no slot is on this bus.
    pub fn is_empty(&self) -> bool {
        self.mine.is_empty()
    }

    /// Something was wrong with the line at `at`: what was heard was no answer, or somebody else talked.
    pub fn note_trouble(&mut self, at: Instant) {
        self.silence.trouble(at);
        self.troubled = self.faulty;
    }

    /// The slot has answered.
    pub fn note_answer(&mut self, slot: usize) {
        self.silence.heard(slot);
        self.gone.set(slot, false);
    }

    /// Nothing was heard from the slot, nor from anybody else.
    #[inline(never)]
    pub fn note_no_answer(&mut self, slot: usize, slots: &[Polled]) {
        // The line has just fallen silent. What the nodes have heard before may have made them deaf.
        if core::mem::take(&mut self.troubled) {
            self.doubt(slots);
            self.silence.asked(slot);
        }
        let was_gone = self.gone.has(slot) || slots.get(slot).is_some_and(|polled| polled.turn.dead);
        if !was_gone {
            self.silence.missed(slot);
        }
    }

    /// Nobody is asked until all nodes hear again, whatever they have taken what was sent until `since` for.
    pub fn keep_silent(&mut self, since: Instant) {
        self.silence.begin(since);
        self.look_again();
    }

    /// Nobody is asked before this.
    pub fn silent_until(&self) -> Instant {
        self.silence.until()
    }

    /// Everybody who is not dead may be deaf.
    #[inline(never)]
    pub fn doubt(&mut self, slots: &[Polled]) {
        self.silence.doubt(self.living(slots));
    }

    /// These are due at once.
    #[inline(never)]
    pub fn schedule_now(&mut self, those: Bits, slots: &mut [Polled], at: Instant) {
        for index in those.iter() {
            if let Some(polled) = slots.get_mut(index) {
                polled.turn.due = polled.turn.due.min(at);
            }
        }
        self.look_again();
    }

    /// The bus is faulty as a whole, or is so no more. Whoever was dead may be back: all begin anew.
    #[inline(never)]
    pub fn set_faulty(&mut self, faulty: bool, slots: &mut [Polled], at: Instant) {
        self.faulty = faulty;
        self.troubled = false;
        if faulty {
            self.gone = self.mine.without(self.living(slots));
        }
        for index in self.mine.iter() {
            if let Some(polled) = slots.get_mut(index) {
                polled.turn.revive();
                polled.lose_track();
            }
        }
        self.schedule_now(self.mine, slots, at);
        if !faulty {
            self.doubt(slots);
        }
    }

    /// A reading of the slot ended at `at`, in silence or not.
    pub fn note_silence(&mut self, polled: &mut Polled, asked: &Asked, silent: bool, at: Instant) {
        let was_dead = polled.turn.dead;
        polled.turn.silent = if silent { polled.turn.silent.saturating_add(1) } else { 0 };
        if silent {
            polled.slot.doubt_identity();
        }
        let gone = polled.slot.measured().is_none_or(|read| at.since(read) >= GONE_AFTER);
        polled.turn.dead = !self.faulty && gone && polled.turn.silent >= DEAD_AFTER;
        if !polled.turn.dead {
            polled.turn.pause_ms = 0;
            return;
        }
        polled.lose_track();
        if was_dead {
            let others = self.probe_share.saturating_sub(1);
            self.probe_took = at.since(asked.since);
            self.probe_at = at + self.probe_took.times(others);
            let grown =
                polled.turn.pause_ms.saturating_add(polled.turn.pause_ms / PAUSE_GROWS).saturating_add(1);
            polled.turn.pause_ms = grown.min(LONGEST_PAUSE_MS);
            polled.turn.due = polled.turn.due.max(at + Duration::from_millis(polled.turn.pause_ms.into()));
        } else {
            self.silence.died(at);
        }
    }
}
