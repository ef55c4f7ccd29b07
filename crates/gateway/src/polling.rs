//! The polling of one bus: earliest deadline first, retries, dead nodes, and what an outcome means for the slot.
//!
//! A slot is asked when it is due and the master can tell its answer from a late one; while it cannot, others are
//! asked. A failed reading is tried again if that can be done soon.
//!
//! A node that has not answered [`DEAD_AFTER`] readings in a row, and not for [`GONE_AFTER`], is taken for dead. Dead
//! nodes are probed one after another, without retries, and together get [one part](PROBE_SHARE) of the bus: however
//! many there are, the others keep the rest.

use core::marker::PhantomData;

use clino_bus::{Fault, Master, Micros, Outcome, Protocol, Retry};
use clino_codec::angle::Angle;

use crate::slot::Slot;
use crate::{Bus, Source, Status};

mod isu;
mod t7;

/// What makes a slot pollable with protocol `P`: the request, and the angle in its answer.
pub(crate) trait Poll: Protocol {
    const BUS: Bus;
    fn request(source: &Source) -> Option<(Self::Address, Self::Request)>;
    fn angle(answer: &Self::Answer) -> Result<Angle, Status>;
    /// What a refused answer says about the slot.
    fn refused(error: &Self::DecodeError) -> Status;
}

/// Readings in a row without any answer after which a node is taken for dead.
const DEAD_AFTER: u8 = 3;
/// A node that has answered within this time is not dead, but has perhaps taken noise for the beginning of a long
/// command: it then takes what is asked for the rest of that, and the more often it is asked the sooner it is back.
const GONE_AFTER: Micros = Micros::from_millis(1_000);
/// Dead nodes together get one part in so many of the bus: 7 %. A dead T7, 2.5 ms a probe, is probed every 37 ms if it
/// is alone, every 1.2 s if it is one of 31.
const PROBE_SHARE: u64 = 15;

pub(crate) struct Polling<P: Poll> {
    asked: Option<Asked>,
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
struct Asked {
    slot: usize,
    since: Micros,
}

impl<P: Poll> Polling<P> {
    pub fn new() -> Self {
        Polling { asked: None, probe_at: Micros::ZERO, idle_until: Micros::ZERO, protocol: PhantomData }
    }

    /// The slot means something else now: what is still to come for it is nobody's.
    pub fn forget(&mut self, slot: usize) {
        if self.asked.is_some_and(|asked| asked.slot == slot) {
            self.asked = None;
        }
        self.look_again();
    }

    /// Something has happened that may change what is to be asked, and when.
    pub fn look_again(&mut self) {
        self.idle_until = Micros::ZERO;
    }

    /// Begins the next exchange that is due, if one is; returns the frame to submit to the line. To be called while
    /// the master has none in hand.
    pub fn next(&mut self, master: &mut Master<P>, now: Micros, slots: &mut [Slot]) -> Option<P::Frame> {
        if now < self.idle_until {
            return None;
        }
        let soonest = self.soonest(master, now, slots);
        let index = match soonest {
            Some((at, index)) if at <= now => index,
            later => {
                self.idle_until = later.map_or(NEVER, |(at, _)| at);
                return None;
            }
        };
        self.look_again();
        let slot = slots.get_mut(index)?;
        let (address, request) = P::request(&slot.config.source)?;
        self.asked = Some(Asked { slot: index, since: now });
        if slot.tried > 0 {
            return master.begin_retry(address, &request, now).ok();
        }
        slot.book_next(now);
        master.begin(address, &request, now).ok()
    }

    /// When [`Polling::next`] has something to begin, if ever.
    pub fn poll_at(&self) -> Option<Micros> {
        (self.idle_until != NEVER).then_some(self.idle_until)
    }

    /// The slot that may be asked first, and when; of those that may be asked now, the one that is due for longest.
    fn soonest(&self, master: &Master<P>, now: Micros, slots: &[Slot]) -> Option<(Micros, usize)> {
        let mut soonest: Option<(Micros, Micros, usize)> = None;
        for (index, slot) in pollable::<P>(slots) {
            let due = due(slot);
            // Most often one can be asked now that has waited longer; the rest of the look is for when none can.
            if soonest.is_some_and(|(at, waited_since, _)| at == now && waited_since <= due) {
                continue;
            }
            let free = self.free(slot);
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

    /// When the slot may be asked: when it is due, and there is time for dead nodes if it is one.
    fn free(&self, slot: &Slot) -> Micros {
        if slot.dead { due(slot).max(self.probe_at) } else { due(slot) }
    }

    /// Takes the outcome of an exchange that was begun here.
    pub fn settle(&mut self, master: &Master<P>, outcome: Outcome<P>, slots: &mut [Slot]) {
        let Outcome { result, at } = outcome;
        self.look_again();
        let Some(Asked { slot, since }) = self.asked.take() else { return };
        let Some(slot) = slots.get_mut(slot) else { return };
        let dead = slot.dead;
        let result = match &result {
            Ok(answer) => P::angle(answer),
            Err(fault) => {
                let retry = if dead { Retry::NEVER } else { Retry::times(slot.config.retries) };
                slot.tried = slot.tried.saturating_add(1);
                let request = P::request(&slot.config.source);
                let again = request.and_then(|(address, request)| {
                    let after = retry.after::<P>(slot.tried, &request, fault, at)?;
                    Some(master.ask_at(address, &request)?.max(after))
                });
                // A retry that would be late for half of the next reading's period is left to that reading.
                if again.is_some_and(|again| again <= slot.due + half(slot.config.period)) {
                    return;
                }
                Err(status_of::<P>(fault))
            }
        };
        slot.tried = 0;
        slot.silent = if result == Err(Status::NoAnswer) { slot.silent.saturating_add(1) } else { 0 };
        slot.dead =
            slot.silent >= DEAD_AFTER && slot.last_read().is_none_or(|read| at.since(read) >= GONE_AFTER);
        if dead && slot.dead {
            self.probe_at = at + at.since(since).times(PROBE_SHARE.saturating_sub(1));
        }
        slot.settle(result, at);
    }
}

/// When the slot wants to be asked; a retry goes first. Asked of every slot before every request.
#[inline(always)]
fn due(slot: &Slot) -> Micros {
    if slot.tried > 0 { Micros::ZERO } else { slot.due }
}

/// When the master can ask for it.
fn ask_at<P: Poll>(master: &Master<P>, slot: &Slot) -> Option<Micros> {
    let (address, request) = P::request(&slot.config.source)?;
    master.ask_at(address, &request)
}

fn half(span: Micros) -> Micros {
    Micros(span.0 / 2)
}

fn pollable<P: Poll>(slots: &[Slot]) -> impl Iterator<Item = (usize, &Slot)> {
    slots.iter().enumerate().filter(|(_, slot)| slot.config.source.bus() == Some(P::BUS))
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
