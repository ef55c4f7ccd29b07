//! Which slot of a bus is asked next, and when: earliest deadline first.
//!
//! *Deadlines.* A period begins where the last one was due to begin, however late it was asked: no drift. A period that
//! the bus had no time for is left out and counted (`Turn::book_next`). An ISU is due when it has something new, which
//! is no fixed period (`refresh.rs`). A retry goes first; a value that has to be confirmed (`slot/plausibility.rs`) is
//! due [`CONFIRM_AFTER`] it came, if not sooner.
//!
//! *Dead nodes.* A node that has not answered [`DEAD_AFTER`] readings in a row, and not for [`GONE_AFTER`], is taken
//! for dead. Dead nodes are probed one after another, without retries, each after a pause that grows by a
//! [part](PAUSE_GROWS) with every probe, up to [`LONGEST_PAUSE_MS`]: exponential back-off. Together they get one part
//! of the bus ([`Queue::new`]), however many there are, and the time in which no other slot is due; the others keep the
//! rest. A node that is back is found within 2 s.
//!
//! *Faulty bus.* While no node on a bus answers (`outage.rs`), none is taken for dead: each slot is asked once in its
//! period, or as often as the bus can, without retries. So the first node that recovers answers within one cycle, the
//! time that the bus needs to ask all its slots once; and then all are due at once. Earlier values confirm nothing.
//!
//! *Deaf nodes* recognise requests again after a silence (`silence.rs`).
//!
//! *Time.* Looking through all slots takes longer than the bus should wait between two exchanges. So it is done while
//! an answer is awaited ([`Queue::look_ahead`]), and again only if that exchange does not end well.

use clino_bus::{Duration, Instant};

use super::Polled;
use super::silence::Silence;
use crate::bits::Bits;
use crate::trace::Purpose;

/// A value that has to be confirmed is asked for again after this. What has damaged the first answer is over then:
/// twenty milliseconds are two periods of the mains' harmonics, and the exchanges of several other nodes.
pub(crate) const CONFIRM_AFTER: Duration = Duration::from_millis(20);
/// Readings in a row without any answer after which a node is taken for dead.
const DEAD_AFTER: u8 = 3;
/// A node that has answered within this time is not dead, but has perhaps taken noise for the beginning of a long
/// command: it then takes what is asked for the rest of that, and the more often it is asked the sooner it is back.
const GONE_AFTER: Duration = Duration::from_millis(1_000);
/// The pause after the first probe of a node.
const FIRST_PAUSE_MS: u16 = 1;
/// The pause between two probes of a node grows by one part in this many, and by a millisecond.
const PAUSE_GROWS: u16 = 16;
/// The longest pause. What is left of 2 s is for the other dead nodes.
const LONGEST_PAUSE_MS: u16 = 1_200;
/// No request is scheduled.
const NEVER: Instant = Instant::NEVER;

/// The exchange under way.
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
    /// The slot that is next if the exchange under way ends well.
    ahead: Option<usize>,
    /// Dead nodes together get one part in this many of the bus.
    probe_share: u32,
    silence: Silence,
    /// No node on the bus answers.
    faulty: bool,
    /// There was a line error since the bus is faulty.
    troubled: bool,
    /// Slots that were dead before that.
    gone: Bits,
    /// No dead node is asked before this, unless no other slot is due.
    probe_at: Instant,
    /// What the last probe took.
    probe_took: Duration,
    /// No request is due before this. Found by looking through all slots, which is not done for every character
    /// that comes in.
    idle_until: Instant,
}

impl Queue {
    /// The queue of no slot. Dead nodes together get one part in `probe_share` of the bus; after a silence of
    /// `silence` every node recognises requests again.
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

    /// The slot is set anew: an answer that is still to come for it is discarded.
    pub fn forget(&mut self, slot: usize, is_mine: bool) {
        self.mine.set(slot, is_mine);
        self.asked.take_if(|asked| asked.slot == slot);
        self.ahead = None;
        self.silence.forget(slot);
        self.gone.set(slot, false);
        self.look_again();
    }

    /// An event may have changed which request is due, and when.
    pub fn look_again(&mut self) {
        self.idle_until = Instant::ZERO;
    }

    /// When the next request is due, if ever.
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

    /// The exchange under way has ended.
    pub fn end(&mut self) -> Option<Asked> {
        self.look_again();
        self.asked.take()
    }

    /// The exchange under way has failed: the next slot has to be found again.
    pub fn end_badly(&mut self) -> Option<Asked> {
        self.ahead = None;
        self.end()
    }

    /// Our last stop bit was out at `at`; there is time to find the next slot.
    pub fn look_ahead(&mut self, at: Instant, slots: &[Polled]) {
        let Some(asked) = &mut self.asked else { return };
        asked.released = at;
        let under_way = asked.slot;
        let mut ahead: Option<(Instant, usize)> = None;
        for (index, polled) in self.mine(slots) {
            // Whether the slot under way is due for more than its next reading is known when its exchange has ended.
            let due = if index == under_way { polled.turn.due } else { polled.due(CONFIRM_AFTER, at) };
            let free = match polled.turn.is_dead() {
                true if index == under_way => NEVER,
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
            for (index, polled) in self.mine(slots).filter(|(_, polled)| polled.turn.is_dead() == dead) {
                let due = polled.due(CONFIRM_AFTER, now);
                let disturbs = due.max(now) + self.probe_took > next_living;
                let free = if dead && disturbs { due.max(self.probe_at) } else { due };
                let beaten =
                    |at| soonest.is_some_and(|(other_at, other_due, _)| (other_at, other_due) <= (at, due));
                // The master is asked only about slots that would be first without its limits.
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
        if polled.turn.is_dead() {
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
            .filter(|(_, polled)| polled.turn.is_dead())
            .for_each(|(index, _)| living.set(index, false));
        living
    }

    /// Whether no slot is on this bus.
    pub fn is_empty(&self) -> bool {
        self.mine.is_empty()
    }

    /// A line error at `at`: the characters received were no answer, or another sender was active.
    pub fn note_trouble(&mut self, at: Instant) {
        self.silence.trouble(at);
        self.troubled = self.faulty;
    }

    /// The slot has answered.
    pub fn note_answer(&mut self, slot: usize) {
        self.silence.heard(slot);
        self.gone.set(slot, false);
    }

    /// Nothing was received after a request of the slot, neither from its node nor from another sender.
    #[inline(never)]
    pub fn note_no_answer(&mut self, slot: usize, slots: &[Polled]) {
        // The line has just fallen silent. What the nodes have received before may have made them deaf.
        if core::mem::take(&mut self.troubled) {
            self.suspect_deaf(slots);
            self.silence.asked(slot);
        }
        let was_gone = self.gone.has(slot) || slots.get(slot).is_some_and(|polled| polled.turn.is_dead());
        if !was_gone {
            self.silence.missed(slot);
        }
    }

    /// No request is sent until every node recognises requests again, whatever it has made of what was sent until
    /// `since`.
    pub fn keep_silent(&mut self, since: Instant) {
        self.silence.begin(since);
        self.look_again();
    }

    /// No request is sent before this.
    pub fn silent_until(&self) -> Instant {
        self.silence.until()
    }

    /// All nodes that are not dead may be deaf.
    #[inline(never)]
    pub fn suspect_deaf(&mut self, slots: &[Polled]) {
        self.silence.suspect_deaf(self.living(slots));
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

    /// The bus is faulty as a whole, or is so no more. Dead nodes may be back: all begin anew.
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
            self.suspect_deaf(slots);
        }
    }

    /// A reading of the slot ended at `at`, in silence or not.
    pub fn note_silence(&mut self, polled: &mut Polled, asked: &Asked, silent: bool, at: Instant) {
        let was_dead = polled.turn.is_dead();
        polled.turn.silent = if silent { polled.turn.silent.saturating_add(1) } else { 0 };
        if silent {
            polled.slot.forget_identity();
        }
        let gone = polled.slot.measured().is_none_or(|read| at.since(read) >= GONE_AFTER);
        if self.faulty || !gone || polled.turn.silent < DEAD_AFTER {
            polled.turn.pause_ms = 0;
            return;
        }
        polled.lose_track();
        if was_dead {
            let others = self.probe_share.saturating_sub(1);
            self.probe_took = at.since(asked.since);
            self.probe_at = at + self.probe_took.times(others);
            let pause_ms = polled.turn.pause_ms;
            polled.turn.due = polled.turn.due.max(at + Duration::from_millis(pause_ms.into()));
            let grown = pause_ms.saturating_add(pause_ms / PAUSE_GROWS).saturating_add(1);
            polled.turn.pause_ms = grown.min(LONGEST_PAUSE_MS);
            self.silence.stays_dead(at);
        } else {
            polled.turn.pause_ms = FIRST_PAUSE_MS;
            self.silence.died(at);
        }
    }
}
