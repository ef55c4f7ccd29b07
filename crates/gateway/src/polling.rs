//! The polling of one bus: earliest deadline first, retries, dead nodes, and what an outcome means for the slot.
//!
//! *Who is next.* A slot is asked when it is due and the master can tell its answer from a late one; while it cannot,
//! others are asked. A failed reading is tried again if that can be done soon. A value that has to be confirmed
//! (`gate.rs`) is asked for out of turn, once.
//!
//! *Drift.* A period begins where the last one was due to begin, however late it was asked; a period that the bus had no
//! time for is left out and counted. An ISU is asked when it has something new, which is no fixed period (`phase.rs`).
//!
//! *Dead nodes.* A node that has not answered [`DEAD_AFTER`] readings in a row is taken for dead. Dead nodes are probed
//! one after another, without retries, each after a pause that grows by a [part](PAUSE_GROWS) with every probe, up to
//! [`LONGEST_PAUSE_MS`]: exponential back-off. Together they get [one part](Poll::PROBE_SHARE) of the bus, however many
//! there are; the others keep the rest. A node that is back is found within 2 s.
//!
//! *Time.* Looking through all slots takes longer than the bus should wait between two exchanges. So it is done while an
//! answer is awaited ([`Polling::look_ahead`]), and again only if that exchange does not end well.

use core::marker::PhantomData;

use clino_bus::{Fault, Master, Micros, Protocol, Refusal, Retry};
use clino_codec::layers::Layer;

use crate::bits::Bits;
use crate::counters::{bump16, bump32};
use crate::slot::{Sample, Slot};
use crate::trace::Purpose;
use crate::{Bus, SlotConfig, Status};

mod isu;
mod t7;

/// What makes a slot pollable with protocol `P`: the request, and the angle in its answer.
pub(crate) trait Poll: Protocol {
    const BUS: Bus;
    /// Dead nodes together get one part in so many of the bus.
    const PROBE_SHARE: u64;
    /// A value that has to be confirmed is asked for again after this: what has damaged the first answer is over then.
    const CONFIRM_AFTER: Micros;
    /// Two angles this close are the same, in µ°.
    const RESOLUTION: u32;
    /// The request that reads a slot. One that confirms differs from the first, if the protocol has two that say the same.
    fn request(config: &SlotConfig, confirm: bool) -> Option<(Self::Address, Self::Request)>;
    fn sample(answer: &Self::Answer, config: &SlotConfig) -> Result<Sample, Status>;
    /// What a refused answer says about the slot.
    fn refused(error: &Self::DecodeError) -> Status;
    /// A good reading ended at `at`, begun at `since`, whose request was out at `released`: returns whether the sensor
    /// has measured anew, and may change when the slot is due.
    fn note(slot: &mut Slot, sample: &Sample, since: Micros, released: Micros, at: Micros) -> bool;
    /// Address and command in a request.
    fn named(frame: &[u8]) -> (u8, u8);
}

/// Readings in a row without any answer after which a node is taken for dead.
const DEAD_AFTER: u8 = 3;
/// A pause between two probes of a node grows by one part in so many, and by a millisecond.
const PAUSE_GROWS: u16 = 16;
/// The longest pause. What is left of 2 s is for the other dead nodes: 13 ISUs with [`Poll::PROBE_SHARE`].
const LONGEST_PAUSE_MS: u16 = 1_200;

pub(crate) struct Polling<P: Poll> {
    /// The slots of this bus.
    mine: Bits,
    asked: Option<Asked>,
    /// Who is next if the exchange in hand ends well.
    ahead: Option<usize>,
    /// No dead node is asked before this.
    probe_at: Micros,
    /// Nothing is to be asked before this. Found by looking through all slots, which is not done for every character
    /// that comes in.
    idle_until: Micros,
    protocol: PhantomData<P>,
}

/// Nothing will be to be asked.
const NEVER: Micros = Micros(u64::MAX);

/// The exchange in hand.
#[derive(Clone, Copy)]
pub(crate) struct Asked {
    pub slot: usize,
    since: Micros,
    /// Our last stop bit.
    released: Micros,
    purpose: Purpose,
    /// Characters of the answer after the first, and how long they take.
    rest_characters: u64,
    rest: Micros,
}

impl<P: Poll> Polling<P> {
    pub fn new(slots: &[Slot]) -> Self {
        Polling {
            mine: Bits::of(slots, is_mine::<P>),
            asked: None,
            ahead: None,
            probe_at: Micros::ZERO,
            idle_until: Micros::ZERO,
            protocol: PhantomData,
        }
    }

    /// The slot means something else now: what is still to come for it is nobody's.
    pub fn forget(&mut self, index: usize, slot: &Slot) {
        self.mine.set(index, is_mine::<P>(slot));
        if self.asked.is_some_and(|asked| asked.slot == index) {
            self.asked = None;
        }
        self.ahead = None;
        self.look_again();
    }

    /// Something has happened that may change what is to be asked, and when.
    pub fn look_again(&mut self) {
        self.idle_until = Micros::ZERO;
    }

    /// Begins the next exchange that is due, if one is; returns the frame to submit to the line, and why. To be called
    /// while the master has none in hand.
    pub fn next(
        &mut self,
        master: &mut Master<P>,
        now: Micros,
        slots: &mut [Slot],
    ) -> Option<(P::Frame, Purpose)> {
        if now < self.idle_until {
            return None;
        }
        let index = match self.take_ahead(master, now, slots) {
            Some(index) => index,
            None => match self.soonest(master, now, slots) {
                Some((at, index)) if at <= now => index,
                later => {
                    self.idle_until = later.map_or(NEVER, |(at, _)| at);
                    return None;
                }
            },
        };
        self.look_again();
        self.begin(master, now, index, slots.get_mut(index)?)
    }

    fn begin(
        &mut self,
        master: &mut Master<P>,
        now: Micros,
        index: usize,
        slot: &mut Slot,
    ) -> Option<(P::Frame, Purpose)> {
        let (address, request) = request::<P>(slot)?;
        let rest_characters = (P::size(&P::expected(address, &request)) as u64).saturating_sub(1);
        let (purpose, frame) = if slot.tried > 0 {
            (Purpose::Retry, master.begin_retry(address, &request, now))
        } else {
            if slot.due <= now {
                slot.book_next(now);
            }
            let purpose = match is_dead(slot) {
                true => Purpose::Probe,
                false if slot.is_to_confirm() => Purpose::Confirmation,
                false => Purpose::Reading,
            };
            (purpose, master.begin(address, &request, now))
        };
        let frame = frame.ok()?;
        if slot.config.timeout.as_micros() > 0 {
            master.allow(slot.config.timeout.into());
        }
        bump32(&mut slot.counters.requests);
        if purpose == Purpose::Retry {
            bump32(&mut slot.counters.retries);
        }
        let rest = Micros::ZERO;
        self.asked = Some(Asked { slot: index, since: now, released: now, purpose, rest_characters, rest });
        Some((frame, purpose))
    }

    /// When [`Polling::next`] has something to begin, if ever.
    pub fn poll_at(&self) -> Option<Micros> {
        (self.idle_until != NEVER).then_some(self.idle_until)
    }

    /// Our last stop bit was out at `at`; there is time to see who is next.
    pub fn look_ahead(&mut self, master: &Master<P>, at: Micros, slots: &[Slot]) {
        let Some(asked) = &mut self.asked else { return };
        asked.released = at;
        asked.rest = master.timing().serial.characters(asked.rest_characters);
        let asked = *asked;
        // What the slot in hand is due for besides, the exchange in hand will tell.
        let mut ahead: Option<(Micros, usize)> = None;
        for (index, slot) in self.mine(slots) {
            let in_hand = index == asked.slot;
            let due = if in_hand { slot.due } else { due::<P>(slot, at) };
            let free = if is_dead(slot) { due.max(self.probe_at) } else { due };
            let out = in_hand && is_dead(slot);
            if free <= at && !out && ahead.is_none_or(|(earliest, _)| due < earliest) {
                ahead = Some((due, index));
            }
        }
        self.ahead = ahead.map(|(_, index)| index);
    }

    /// Who was found to be next, if that has not changed.
    fn take_ahead(&mut self, master: &Master<P>, now: Micros, slots: &[Slot]) -> Option<usize> {
        let index = self.ahead.take()?;
        let slot = slots.get(index)?;
        (self.free(slot, now) <= now && ask_at(master, slot)? <= now).then_some(index)
    }

    /// The slot that may be asked first, and when; of those that may be asked now, the one that is due for longest.
    fn soonest(&self, master: &Master<P>, now: Micros, slots: &[Slot]) -> Option<(Micros, usize)> {
        let mut soonest: Option<(Micros, Micros, usize)> = None;
        for (index, slot) in self.mine(slots) {
            let (due, free) = (due::<P>(slot, now), self.free(slot, now));
            let beaten =
                |at| soonest.is_some_and(|(other_at, other_due, _)| (other_at, other_due) <= (at, due));
            // The master is asked only about those that would be first if it had nothing against it.
            if !beaten(free.max(now))
                && let Some(at) = ask_at(master, slot).map(|ask_at| free.max(ask_at).max(now))
                && !beaten(at)
            {
                soonest = Some((at, due, index));
            }
        }
        soonest.map(|(at, _, index)| (at, index))
    }

    fn mine<'a>(&self, slots: &'a [Slot]) -> impl Iterator<Item = (usize, &'a Slot)> {
        self.mine.iter().filter_map(|index| Some((index, slots.get(index)?)))
    }

    /// When the slot may be asked: when it is due, and there is time for dead nodes if it is one.
    fn free(&self, slot: &Slot, now: Micros) -> Micros {
        if is_dead(slot) { due::<P>(slot, now).max(self.probe_at) } else { due::<P>(slot, now) }
    }

    /// The exchange begun here has ended well, with this answer. What it says is for [`Polling::take`], later.
    pub fn end(&mut self, answer: &P::Answer, slots: &mut [Slot]) -> Option<(Asked, Result<Sample, Status>)> {
        self.look_again();
        let asked = self.asked.take()?;
        let slot = slots.get_mut(asked.slot)?;
        slot.tried = 0;
        slot.relax();
        Some((asked, P::sample(answer, &slot.config)))
    }

    /// Takes what an answer at `at` has said. Returns the slot whose value has changed, if one has.
    pub fn take(
        &mut self,
        asked: &Asked,
        result: Result<Sample, Status>,
        at: Micros,
        slots: &mut [Slot],
    ) -> Option<usize> {
        let slot = slots.get_mut(asked.slot)?;
        let due = slot.due;
        let fresh = answered::<P>(slot, asked, &result, at);
        self.note_silence(slot, asked, false, at);
        let changed = slot.settle(result, at, fresh, P::RESOLUTION);
        if slot.due != due || slot.is_to_confirm() {
            self.look_again();
        }
        changed.then_some(asked.slot)
    }

    /// Takes the outcome of an exchange that has failed at `at`. Returns the slot whose value has changed, if one has.
    pub fn fail(
        &mut self,
        master: &Master<P>,
        fault: &Fault<P::DecodeError>,
        at: Micros,
        slots: &mut [Slot],
    ) -> Option<usize> {
        self.look_again();
        self.ahead = None;
        let asked = self.asked.take()?;
        let slot = slots.get_mut(asked.slot)?;
        failed(slot, fault);
        if self.is_retried(master, slot, fault, at) {
            return None;
        }
        slot.tried = 0;
        let status = status_of::<P>(fault);
        self.note_silence(slot, &asked, status == Status::NoAnswer, at);
        slot.settle(Err(status), at, false, P::RESOLUTION).then_some(asked.slot)
    }

    /// Whether the reading that failed is tried again; then it has not ended yet.
    fn is_retried(
        &self,
        master: &Master<P>,
        slot: &mut Slot,
        fault: &Fault<P::DecodeError>,
        at: Micros,
    ) -> bool {
        let retry = if is_dead(slot) { Retry::NEVER } else { Retry::times(slot.config.retries) };
        slot.tried = slot.tried.saturating_add(1);
        let again = request::<P>(slot).and_then(|(address, request)| {
            let after = retry.after::<P>(slot.tried, &request, fault, at)?;
            Some(master.ask_at(address, &request)?.max(after))
        });
        // A retry that would be late for half of the next reading's period is left to that reading.
        again.is_some_and(|again| again <= slot.due + half(slot.config.period()))
    }

    /// A reading ended at `at`, in silence or not.
    fn note_silence(&mut self, slot: &mut Slot, asked: &Asked, silent: bool, at: Micros) {
        let was_dead = is_dead(slot);
        slot.silent = if silent { slot.silent.saturating_add(1) } else { 0 };
        if !is_dead(slot) {
            slot.pause_ms = 0;
            return;
        }
        slot.lose_track();
        if was_dead {
            let others = P::PROBE_SHARE.saturating_sub(1);
            self.probe_at = at + at.since(asked.since).times(others);
            let grown = slot.pause_ms.saturating_add(slot.pause_ms / PAUSE_GROWS).saturating_add(1);
            slot.pause_ms = grown.min(LONGEST_PAUSE_MS);
            slot.due = slot.due.max(at + Micros::from_millis(slot.pause_ms.into()));
        }
    }
}

/// A good answer came. Returns whether the sensor has measured anew.
fn answered<P: Poll>(slot: &mut Slot, asked: &Asked, result: &Result<Sample, Status>, at: Micros) -> bool {
    slot.counters.answered(at.since(asked.released + asked.rest));
    slot.note_link(false);
    let Ok(sample) = result else {
        bump16(&mut slot.counters.refused);
        return false;
    };
    if asked.purpose != Purpose::Retry {
        bump32(&mut slot.counters.first_try);
    }
    P::note(slot, sample, asked.since, asked.released, at)
}

/// There was no good answer.
fn failed<E: Refusal>(slot: &mut Slot, fault: &Fault<E>) {
    slot.counters.failed(fault);
    let damaged = match fault {
        Fault::NoAnswer { .. } | Fault::LineBusy | Fault::NotSent | Fault::Over { .. } => false,
        Fault::Garbled { .. } | Fault::Contention => true,
        Fault::Bad(error) => !matches!(error.layer(), Layer::Address | Layer::Command),
    };
    slot.note_link(damaged);
    if damaged {
        slot.shake();
    }
}

/// When the slot wants to be asked; a retry goes first.
fn due<P: Poll>(slot: &Slot, now: Micros) -> Micros {
    match slot.confirm_at(P::CONFIRM_AFTER, now) {
        _ if slot.tried > 0 => Micros::ZERO,
        Some(confirm_at) => confirm_at.min(slot.due),
        None => slot.due,
    }
}

/// What the slot is asked next.
fn request<P: Poll>(slot: &Slot) -> Option<(P::Address, P::Request)> {
    P::request(&slot.config, slot.is_to_confirm())
}

/// When the master can ask for it.
fn ask_at<P: Poll>(master: &Master<P>, slot: &Slot) -> Option<Micros> {
    let (address, request) = request::<P>(slot)?;
    master.ask_at(address, &request)
}

fn half(span: Micros) -> Micros {
    Micros(span.0 / 2)
}

fn is_dead(slot: &Slot) -> bool {
    slot.silent >= DEAD_AFTER
}

fn is_mine<P: Poll>(slot: &Slot) -> bool {
    slot.config.bus() == Some(P::BUS)
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
