//! The polling of one bus: what a slot is asked, and what comes of it. `schedule/queue.rs` decides which slot is next.
//!
//! An answer is taken in two steps: [`Polling::end`] while the bus waits for the next request, [`Polling::take`] when
//! that is on its way. A reading that failed is tried again, if that can be done soon.

use clino_bus::{Duration, Fault, Instant, Retry};
use clino_codec::checks::Check;

use super::endpoint::{Endpoint, Frame};
use crate::Status;
use crate::counters::{bump16, bump32};
use crate::schedule::Polled;
use crate::schedule::outage::{BusHealth, Consequence, Watch};
use crate::schedule::queue::{Asked, Queue};
use crate::slot::{Identity, Sample, Slot};
use crate::trace::{Purpose, Verdict};

/// What an answer has said: a value, why there is none, or nothing about the value.
pub(crate) type Said = Result<Option<Sample>, Status>;

pub(crate) struct Polling {
    queue: Queue,
    watch: Watch,
}

impl Polling {
    /// The polling of no slot, for `PROBE_SHARE` and `SILENCE` of its protocol.
    #[inline(always)]
    pub fn idle(probe_share: u32, silence: Duration) -> Self {
        Polling { queue: Queue::new(probe_share, silence), watch: Watch::default() }
    }

    /// The slot of the exchange under way.
    pub fn asked(&self) -> Option<usize> {
        self.queue.asked()
    }

    /// How the bus as a whole is doing.
    pub fn health(&self) -> BusHealth {
        self.watch.health()
    }

    /// Sets what was counted to zero.
    pub fn clear_counters(&mut self) {
        self.watch.clear_counters();
    }

    /// The slot is set anew: an answer that is still to come for it is discarded.
    pub fn forget(&mut self, index: usize, is_mine: bool) {
        self.queue.forget(index, is_mine);
        self.watch.forget(index);
        if self.queue.is_empty() {
            self.queue.set_faulty(false, &mut [], Instant::ZERO);
            self.watch.retire();
        }
    }

    /// The bus has another bit rate: the nodes may have taken what was sent until `since` for anything. No request is
    /// sent until every node recognises requests again.
    pub fn keep_silent(&mut self, since: Instant) {
        self.queue.keep_silent(since);
    }

    /// No request is sent before this.
    pub fn silent_until(&self) -> Instant {
        self.queue.silent_until()
    }

    /// A node on the bus has answered.
    pub fn heard(&mut self, end: &dyn Endpoint, at: Instant, slots: &mut [Polled]) {
        if self.watch.answered(end.counters()) {
            self.queue.set_faulty(false, slots, at);
        }
    }

    /// An event may have changed which request is due, and when.
    pub fn look_again(&mut self) {
        self.queue.look_again();
    }

    /// When [`Polling::next`] has something to begin, if ever.
    pub fn poll_at(&self) -> Option<Instant> {
        self.queue.poll_at()
    }

    /// Our last stop bit was out at `at`; there is time to find the next slot.
    pub fn look_ahead(&mut self, at: Instant, slots: &[Polled]) {
        self.queue.look_ahead(at, slots);
    }

    /// Begins the next exchange that is due, if one is; returns the frame to submit to the line, and why. To be called
    /// while the master has none under way.
    pub fn next(
        &mut self,
        end: &mut dyn Endpoint,
        now: Instant,
        slots: &mut [Polled],
    ) -> Option<(Frame, Purpose)> {
        let index = self.queue.next(now, slots, &|polled| end.ask_at(&polled.slot))?;
        let polled = slots.get_mut(index)?;
        let purpose = polled.purpose();
        let Polled { slot, turn } = polled;
        if purpose != Purpose::Retry && turn.due <= now && turn.book_next(slot.config.period, now) {
            bump16(&mut slot.counters.skipped);
        }
        let begun = end.ask(slot, purpose == Purpose::Retry, now)?;
        bump32(&mut slot.counters.requests);
        if purpose == Purpose::Retry {
            bump32(&mut slot.counters.retries);
        }
        let rest_characters = begun.rest_characters;
        self.queue.begin(Asked { slot: index, since: now, purpose, released: now, rest_characters });
        Some((begun.frame, purpose))
    }

    /// The exchange begun here has ended well: with the value, or the identity of the sensor. What it says is for
    /// [`Polling::take`], later.
    pub fn end(
        &mut self,
        end: &dyn Endpoint,
        answer: Result<Result<Sample, Status>, Identity>,
        at: Instant,
        slots: &mut [Polled],
    ) -> Option<(Asked, Said)> {
        self.heard(end, at, slots);
        let asked = self.queue.end()?;
        self.queue.note_answer(asked.slot);
        let Polled { slot, turn } = slots.get_mut(asked.slot)?;
        turn.tried = 0;
        slot.relax();
        let said = match answer {
            Err(identity) => slot.identify(identity).map(|()| None),
            Ok(value) => value.map(Some),
        };
        Some((asked, said))
    }

    /// Takes the content of an answer at `at`; if it is not `used`, only the fact that an answer came. Returns the slot
    /// whose value has changed, if one has.
    pub fn take(
        &mut self,
        end: &dyn Endpoint,
        asked: &Asked,
        said: Said,
        used: bool,
        at: Instant,
        slots: &mut [Polled],
    ) -> Option<usize> {
        let polled = slots.get_mut(asked.slot)?;
        let due = polled.turn.due;
        let rest = end.timing().serial.characters(asked.rest_characters);
        polled.slot.note_answer(at.since(asked.released + rest), asked.purpose, said.is_ok());
        self.queue.note_silence(polled, asked, false, at);
        let Polled { slot, turn } = polled;
        if !used {
            return None;
        }
        // Its value is next.
        let Some(result) = said.transpose() else {
            turn.due = turn.due.min(at);
            self.look_again();
            return None;
        };
        let fresh = result.as_ref().is_ok_and(|sample| end.note(turn, &slot.config, sample, asked, at));
        let changed = slot.settle(result, at, fresh, end.facts().resolution);
        if turn.due != due || slot.is_to_confirm() {
            self.look_again();
        }
        changed.then_some(asked.slot)
    }

    /// Takes the outcome of an exchange that has failed at `at`. Returns the slot whose value has changed, if one has.
    pub fn fail(
        &mut self,
        end: &dyn Endpoint,
        (fault, status): (&Fault<Check>, Status),
        at: Instant,
        slots: &mut [Polled],
    ) -> Option<usize> {
        let asked = self.queue.end_badly()?;
        if failed(&mut slots.get_mut(asked.slot)?.slot, fault) {
            self.queue.note_trouble(at);
        }
        let verdict = Verdict::of_fault(fault);
        match verdict {
            Verdict::Value => self.heard(end, at, slots),
            _ => self.note_vain(end, asked.slot, verdict, at, slots),
        }
        let polled = slots.get_mut(asked.slot)?;
        if !self.watch.is_faulty() && is_retried(end, polled, fault, at) {
            return None;
        }
        polled.turn.tried = 0;
        self.queue.note_silence(polled, &asked, status == Status::NoAnswer, at);
        polled.slot.settle(Err(status), at, false, end.facts().resolution).then_some(asked.slot)
    }

    /// A slot was asked in vain.
    fn note_vain(
        &mut self,
        end: &dyn Endpoint,
        slot: usize,
        verdict: Verdict,
        at: Instant,
        slots: &mut [Polled],
    ) {
        if verdict == Verdict::NoAnswer {
            self.queue.note_no_answer(slot, slots);
        }
        let living = self.queue.living(slots);
        match self.watch.failed(slot, verdict, end.counters(), living, at) {
            Consequence::None => {}
            Consequence::Ask(those) => self.queue.schedule_now(those, slots, at),
            Consequence::Faulty => self.queue.set_faulty(true, slots, at),
        }
    }
}

/// Whether the reading that failed is tried again; then it has not ended yet.
fn is_retried(end: &dyn Endpoint, polled: &mut Polled, fault: &Fault<Check>, at: Instant) -> bool {
    let Polled { slot, turn } = polled;
    let retry = if turn.dead { Retry::NEVER } else { Retry::times(slot.config.retries) };
    turn.tried = turn.tried.saturating_add(1);
    // Polling only reads.
    let after = retry.after_harmless(turn.tried, fault, at);
    let again = after.and_then(|after| Some(end.ask_at(slot)?.max(after)));
    // A retry that would be late for half of the next reading's period is left to that reading. A slot without a period
    // has no next reading to be late for.
    let half = Duration::from_micros(slot.config.period.as_micros() / 2);
    again.is_some_and(|again| slot.config.period == Duration::ZERO || again <= turn.due + half)
}

/// There was no good answer. Returns whether something is wrong with the line.
fn failed(slot: &mut Slot, fault: &Fault<Check>) -> bool {
    slot.counters.failed(fault);
    let damaged = match fault {
        Fault::NoAnswer { .. } | Fault::LineBusy | Fault::NotSent | Fault::Over { .. } => false,
        Fault::Garbled { .. } | Fault::Contention => true,
        Fault::Bad(check) => !matches!(check, Check::Address | Check::Command),
    };
    slot.note_damage(damaged);
    damaged || matches!(fault, Fault::LineBusy)
}
