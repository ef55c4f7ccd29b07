//! The polling of one bus: what a slot is asked, and what comes of it. `schedule/queue.rs` decides which slot is next.
//!
//! An answer is taken in two steps: [`Polling::end`] while the bus waits for the next request, [`Polling::take`] when
//! that is on its way. A reading that failed is tried again, if that can be done soon.

use core::marker::PhantomData;

use clino_bus::{Duration, FailedCheck, Fault, Instant, Master, Protocol, Retry};
use clino_codec::checks::Check;

use crate::counters::{bump16, bump32};
use crate::schedule::outage::{BusHealth, Consequence, Watch};
use crate::schedule::queue::{Asked, Queue};
use crate::schedule::{Polled, Turn};
use crate::slot::{Identity, Sample, Slot};
use crate::trace::{Purpose, Verdict};
use crate::{Bus, SlotConfig, Status};

mod isu;
mod t7;

/// What makes a slot pollable with protocol `P`: the request, and the angle in its answer.
pub(crate) trait Poll: Protocol {
    const BUS: Bus;
    /// Dead nodes together get one part in this many of the bus.
    const PROBE_SHARE: u32;
    /// After this silence every node takes the next character for the beginning of a request, whatever it has taken
    /// noise for; zero if that is not known.
    const SILENCE: Duration;
    /// Two angles this close are the same, in µ°.
    const RESOLUTION: u32;
    /// From the end of an exchange that may change what a node says to the last instant at which it does.
    const SETTLES: Duration;
    /// Whether a request with this command may change what the node's angle means.
    fn alters(command: u8) -> bool;
    /// The request that reads a slot. One that confirms differs from the first, if the protocol has two that say the
    /// same.
    fn request(slot: &Slot) -> Option<(Self::Address, Self::Request)>;
    /// The sensor's identity, if the answer carries that and not a value.
    fn identity(_: &Self::Answer) -> Option<Identity> {
        None
    }
    fn sample(answer: &Self::Answer, config: &SlotConfig) -> Result<Sample, Status>;
    /// What a refused answer says about the slot.
    fn refused(error: &Self::DecodeError) -> Status;
    /// A good reading ended at `at`: returns whether the sensor has measured anew, and may change when the slot is due.
    fn note(turn: &mut Turn, config: &SlotConfig, sample: &Sample, asked: &Asked, at: Instant) -> bool;
    /// Address and command in a request.
    fn named(frame: &[u8]) -> (u8, u8);
}

/// What an answer has said: a value, why there is none, or nothing about the value.
pub(crate) type Said = Result<Option<Sample>, Status>;

pub(crate) struct Polling<P: Poll> {
    queue: Queue,
    watch: Watch,
    protocol: PhantomData<P>,
}

impl<P: Poll> Polling<P> {
    /// The polling of no slot.
    #[inline(always)]
    pub fn idle() -> Self {
        let queue = Queue::new(P::PROBE_SHARE, P::SILENCE);
        Polling { queue, watch: Watch::default(), protocol: PhantomData }
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
        self.queue.forget(index, config.bus() == Some(P::BUS));
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
    pub fn heard(&mut self, master: &Master<P>, at: Instant, slots: &mut [Polled]) {
        if self.watch.answered(master.counters()) {
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
        master: &mut Master<P>,
        now: Instant,
        slots: &mut [Polled],
    ) -> Option<(P::Frame, Purpose)> {
        let index = self.queue.next(now, slots, &|polled| ask_at(master, &polled.slot))?;
        let polled = slots.get_mut(index)?;
        let (address, request) = P::request(&polled.slot)?;
        let purpose = polled.purpose();
        let Polled { slot, turn } = polled;
        if purpose != Purpose::Retry && turn.due <= now && turn.book_next(slot.config.period, now) {
            bump16(&mut slot.counters.skipped);
        }
        let frame = match purpose {
            Purpose::Retry => master.begin_retry(address, &request, now),
            _ => master.begin(address, &request, now),
        };
        let frame = frame.ok()?;
        if slot.config.timeout.as_micros() > 0 {
            master.allow(slot.config.timeout);
        }
        bump32(&mut slot.counters.requests);
        if purpose == Purpose::Retry {
            bump32(&mut slot.counters.retries);
        }
        let rest = u32::from(P::reply(&P::expected(address, &request)).characters).saturating_sub(1);
        self.queue.begin(Asked { slot: index, since: now, purpose, released: now, rest_characters: rest });
        Some((frame, purpose))
    }

    /// The exchange begun here has ended well, with this answer. What it says is for [`Polling::take`], later.
    pub fn end(
        &mut self,
        master: &Master<P>,
        answer: &P::Answer,
        at: Instant,
        slots: &mut [Polled],
    ) -> Option<(Asked, Said)> {
        self.heard(master, at, slots);
        let asked = self.queue.end()?;
        self.queue.note_answer(asked.slot);
        let Polled { slot, turn } = slots.get_mut(asked.slot)?;
        turn.tried = 0;
        slot.relax();
        let said = match P::identity(answer) {
            Some(identity) => slot.identify(identity).map(|()| None),
            None => P::sample(answer, &slot.config).map(Some),
        };
        Some((asked, said))
    }

    /// Takes the content of an answer at `at`; if it is not `used`, only the fact that an answer came. Returns the slot
    /// whose value has changed, if one has.
    pub fn take(
        &mut self,
        master: &Master<P>,
        asked: &Asked,
        said: Said,
        used: bool,
        at: Instant,
        slots: &mut [Polled],
    ) -> Option<usize> {
        let polled = slots.get_mut(asked.slot)?;
        let due = polled.turn.due;
        let rest = master.timing().serial.characters(asked.rest_characters);
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
        let fresh = result.as_ref().is_ok_and(|sample| P::note(turn, &slot.config, sample, asked, at));
        let changed = slot.settle(result, at, fresh, P::RESOLUTION);
        if turn.due != due || slot.is_to_confirm() {
            self.look_again();
        }
        changed.then_some(asked.slot)
    }

    /// Takes the outcome of an exchange that has failed at `at`. Returns the slot whose value has changed, if one has.
    pub fn fail(
        &mut self,
        master: &Master<P>,
        fault: &Fault<P::DecodeError>,
        at: Instant,
        slots: &mut [Polled],
    ) -> Option<usize> {
        let asked = self.queue.end_badly()?;
        if failed(&mut slots.get_mut(asked.slot)?.slot, fault) {
            self.queue.note_trouble(at);
        }
        let verdict = Verdict::of_fault(fault);
        match verdict {
            Verdict::Value => self.heard(master, at, slots),
            _ => self.note_vain(master, asked.slot, verdict, at, slots),
        }
        let polled = slots.get_mut(asked.slot)?;
        if !self.watch.is_faulty() && is_retried(master, polled, fault, at) {
            return None;
        }
        polled.turn.tried = 0;
        let status = status_of::<P>(fault);
        self.queue.note_silence(polled, &asked, status == Status::NoAnswer, at);
        polled.slot.settle(Err(status), at, false, P::RESOLUTION).then_some(asked.slot)
    }

    /// A slot was asked in vain.
    fn note_vain(
        &mut self,
        master: &Master<P>,
        slot: usize,
        verdict: Verdict,
        at: Instant,
        slots: &mut [Polled],
    ) {
        if verdict == Verdict::NoAnswer {
            self.queue.note_no_answer(slot, slots);
        }
        let living = self.queue.living(slots);
        match self.watch.failed(slot, verdict, master.counters(), living, at) {
            Consequence::None => {}
            Consequence::Ask(those) => self.queue.schedule_now(those, slots, at),
            Consequence::Faulty => self.queue.set_faulty(true, slots, at),
        }
    }
}

/// Whether the reading that failed is tried again; then it has not ended yet.
fn is_retried<P: Poll>(
    master: &Master<P>,
    polled: &mut Polled,
    fault: &Fault<P::DecodeError>,
    at: Instant,
) -> bool {
    let Polled { slot, turn } = polled;
    let retry = if turn.dead { Retry::NEVER } else { Retry::times(slot.config.retries) };
    turn.tried = turn.tried.saturating_add(1);
    let again = P::request(slot).and_then(|(address, request)| {
        let after = retry.after(turn.tried, P::writes(&request), fault, at)?;
        Some(master.ask_at(address, &request)?.max(after))
    });
    // A retry that would be late for half of the next reading's period is left to that reading. A slot without a period
    // has no next reading to be late for.
    let half = Duration::from_micros(slot.config.period.as_micros() / 2);
    again.is_some_and(|again| slot.config.period == Duration::ZERO || again <= turn.due + half)
}

/// There was no good answer. Returns whether something is wrong with the line.
fn failed<E: FailedCheck>(slot: &mut Slot, fault: &Fault<E>) -> bool {
    slot.counters.failed(fault);
    let damaged = match fault {
        Fault::NoAnswer { .. } | Fault::LineBusy | Fault::NotSent | Fault::Over { .. } => false,
        Fault::Garbled { .. } | Fault::Contention => true,
        Fault::Bad(error) => !matches!(error.failed_check(), Check::Address | Check::Command),
    };
    slot.note_damage(damaged);
    damaged || matches!(fault, Fault::LineBusy)
}

/// When the master can ask for it.
fn ask_at<P: Poll>(master: &Master<P>, slot: &Slot) -> Option<Instant> {
    let (address, request) = P::request(slot)?;
    master.ask_at(address, &request)
}

fn status_of<P: Poll>(fault: &Fault<P::DecodeError>) -> Status {
    match fault {
        Fault::NoAnswer { .. } => Status::NoAnswer,
        Fault::Garbled { .. } => Status::BadAnswer,
        Fault::Bad(error) => P::refused(error),
        // Nothing here is collected.
        Fault::NotSent | Fault::LineBusy | Fault::Contention | Fault::Over { .. } => Status::NotSent,
    }
}
