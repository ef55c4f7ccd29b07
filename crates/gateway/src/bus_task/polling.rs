//! The polling of one bus: what a slot is asked, and what comes of it. `schedule/queue.rs` decides which slot is next.
//!
//! An answer is taken in two steps: [`Polling::end`] while the bus waits for the next request, [`Polling::take`] when
//! that is on its way. A reading that failed is tried again, if that can be done soon.

use clino_bus::{Duration, Engine, ExpectedReply, Fault, Instant, Protocol, Retry};
use clino_codec::checks::Check;

use crate::counters::{bump16, bump32};
use crate::schedule::outage::{BusHealth, Consequence, Watch};
use crate::schedule::queue::{Asked, Queue};
use crate::schedule::{Polled, Sensor, Turn};
use crate::slot::{Identity, Sample, Slot};
use crate::trace::{Purpose, Verdict};
use crate::{Bus, SlotConfig, Status};

mod isu;
mod t7;

/// What the polling of a bus has to know of its sensors.
pub(crate) struct PollRules {
    pub bus: Bus,
    /// Dead nodes together get one part in this many of the bus.
    pub probe_share: u32,
    /// After this silence every node takes the next character for the beginning of a request, whatever it has taken
    /// noise for; zero if that is not known.
    pub silence: Duration,
    /// Two angles this close are the same, in µ°.
    pub resolution: u32,
    /// From the end of an exchange that may change what a node says to the last instant at which it does.
    pub settles: Duration,
    /// A sensor measures anew from time to time and repeats itself in between.
    pub repeats: bool,
    /// The answer that the request for a slot calls for.
    pub reply: fn(&Slot) -> Option<ExpectedReply>,
}

/// What makes a slot pollable with protocol `P`: the request, and the angle in its answer.
pub(crate) trait Poll: Protocol {
    const RULES: PollRules;
    /// Whether a request with this command may change what the node's angle means.
    fn alters(command: u8) -> bool;
    /// The request that reads a slot. One that confirms differs from the first, if the protocol has two that say the
    /// same.
    fn request(slot: &Slot) -> Option<(Self::Address, Self::Request)>;
    /// What an answer contains for a slot that is set like this.
    fn read(answer: &Self::Answer, config: &SlotConfig) -> Content;
    /// What a refused answer says about the slot.
    fn refused(error: &Self::DecodeError) -> Status;
}

/// What an answer contains.
pub(crate) enum Content {
    Sample(Sample),
    /// The sensor's identity, and no value.
    Identity(Identity),
    /// No value, for this reason.
    Nothing(Status),
}

/// What an answer has said: a value, why there is none, or nothing about the value.
pub(crate) type Said = Result<Option<Sample>, Status>;

/// The answer that the request for a slot calls for, as [`PollRules::reply`].
fn reply<P: Poll>(slot: &Slot) -> Option<ExpectedReply> {
    let (address, request) = P::request(slot)?;
    Some(P::reply(&P::expected(address, &request)))
}

pub(crate) struct Polling {
    rules: &'static PollRules,
    queue: Queue,
    watch: Watch,
}

impl Polling {
    /// The polling of no slot.
    #[inline(always)]
    pub fn idle(rules: &'static PollRules) -> Self {
        let queue = Queue::new(rules.probe_share, rules.silence);
        Polling { rules, queue, watch: Watch::default() }
    }

    pub fn rules(&self) -> &'static PollRules {
        self.rules
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
    pub fn forget(&mut self, index: usize, config: &SlotConfig) {
        self.queue.forget(index, config.bus() == Some(self.rules.bus));
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
    pub fn heard(&mut self, engine: &Engine, at: Instant, slots: &mut [Polled]) {
        if self.watch.answered(engine.counters()) {
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

    /// The slot that is due to be asked, if one is, and why. To be called while the master has no exchange under way.
    #[inline(never)]
    pub fn next(&mut self, engine: &Engine, now: Instant, slots: &mut [Polled]) -> Option<(usize, Purpose)> {
        let rules = self.rules;
        let index = self.queue.next(now, slots, &|polled| engine.ask_at(&(rules.reply)(&polled.slot)?))?;
        let polled = slots.get_mut(index)?;
        let purpose = polled.purpose();
        let Polled { slot, turn } = polled;
        if purpose != Purpose::Retry && turn.due <= now && turn.book_next(slot.config.period, now) {
            bump16(&mut slot.counters.skipped);
        }
        Some((index, purpose))
    }

    /// The master has begun to ask for this slot.
    #[inline(never)]
    pub fn begin(
        &mut self,
        engine: &Engine,
        index: usize,
        purpose: Purpose,
        now: Instant,
        polled: &mut Polled,
    ) {
        let counters = &mut polled.slot.counters;
        bump32(&mut counters.requests);
        if purpose == Purpose::Retry {
            bump32(&mut counters.retries);
        }
        let rest = u32::from(engine.expected().characters).saturating_sub(1);
        self.queue.begin(Asked { slot: index, since: now, purpose, released: now, rest_characters: rest });
    }

    /// The exchange begun here has ended well. What its answer says is for [`Polling::take`], later.
    pub fn end(&mut self, engine: &Engine, at: Instant, slots: &mut [Polled]) -> Option<Asked> {
        self.heard(engine, at, slots);
        let asked = self.queue.end()?;
        self.queue.note_answer(asked.slot);
        let Polled { slot, turn } = slots.get_mut(asked.slot)?;
        turn.tried = 0;
        slot.relax();
        Some(asked)
    }

    /// Takes the content of an answer at `at`; if it is not `used`, only the fact that an answer came. Returns the slot
    /// whose value has changed, if one has.
    pub fn take(
        &mut self,
        engine: &Engine,
        asked: &Asked,
        said: Said,
        used: bool,
        at: Instant,
        slots: &mut [Polled],
    ) -> Option<usize> {
        let polled = slots.get_mut(asked.slot)?;
        let due = polled.turn.due;
        let rest = engine.timing().serial.characters(asked.rest_characters);
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
        let fresh = result
            .as_ref()
            .is_ok_and(|sample| !self.rules.repeats || note_refresh(turn, slot, sample, asked, at));
        let changed = slot.settle(result, at, fresh, self.rules.resolution);
        if turn.due != due || slot.is_to_confirm() {
            self.look_again();
        }
        changed.then_some(asked.slot)
    }

    /// Takes the outcome of an exchange that has failed at `at`, and with it the slot's status. Returns the slot whose value
    /// has changed, if one has.
    pub fn fail(
        &mut self,
        engine: &Engine,
        fault: &Fault<Check>,
        status: Status,
        at: Instant,
        slots: &mut [Polled],
    ) -> Option<usize> {
        let asked = self.queue.end_badly()?;
        if failed(&mut slots.get_mut(asked.slot)?.slot, fault) {
            self.queue.note_trouble(at);
        }
        let verdict = Verdict::of_fault(fault);
        match verdict {
            Verdict::Value => self.heard(engine, at, slots),
            _ => self.note_vain(engine, asked.slot, verdict, at, slots),
        }
        let polled = slots.get_mut(asked.slot)?;
        if !self.watch.is_faulty() && self.is_retried(engine, polled, fault, at) {
            return None;
        }
        polled.turn.tried = 0;
        self.queue.note_silence(polled, &asked, status == Status::NoAnswer, at);
        polled.slot.settle(Err(status), at, false, self.rules.resolution).then_some(asked.slot)
    }

    /// A slot was asked in vain.
    fn note_vain(
        &mut self,
        engine: &Engine,
        slot: usize,
        verdict: Verdict,
        at: Instant,
        slots: &mut [Polled],
    ) {
        if verdict == Verdict::NoAnswer {
            self.queue.note_no_answer(slot, slots);
        }
        let living = self.queue.living(slots);
        match self.watch.failed(slot, verdict, engine.counters(), living, at) {
            Consequence::None => {}
            Consequence::Ask(those) => self.queue.schedule_now(those, slots, at),
            Consequence::Faulty => self.queue.set_faulty(true, slots, at),
        }
    }

    /// Whether the reading that failed is tried again; then it has not ended yet.
    fn is_retried(&self, engine: &Engine, polled: &mut Polled, fault: &Fault<Check>, at: Instant) -> bool {
        let Polled { slot, turn } = polled;
        let retry = if turn.is_dead() { Retry::NEVER } else { Retry::times(slot.config.retries) };
        turn.tried = turn.tried.saturating_add(1);
        let again = (self.rules.reply)(slot).and_then(|reply| {
            // A reading writes nothing.
            let after = retry.after(turn.tried, false, fault, at)?;
            Some(engine.ask_at(&reply)?.max(after))
        });
        // A retry that would be late for half of the next reading's period is left to that reading. A slot without a period
        // has no next reading to be late for.
        let half = Duration::from_micros(slot.config.period.as_micros() / 2);
        again.is_some_and(|again| slot.config.period == Duration::ZERO || again <= turn.due + half)
    }
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

/// A good reading of a sensor that repeats itself ended at `at`: whether it has measured anew. Changes when the slot is due.
fn note_refresh(turn: &mut Turn, slot: &Slot, sample: &Sample, asked: &Asked, at: Instant) -> bool {
    let mut refresh = turn.sensor.refresh();
    let fresh = refresh.read(sample.angle != slot.last_said(), asked.released, at);
    if let Some(next) = refresh.next(asked.since, slot.config.period) {
        turn.due = next;
    }
    turn.sensor = Sensor::Refresh(refresh);
    fresh
}
