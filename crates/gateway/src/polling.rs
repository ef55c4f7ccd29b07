//! The polling of one bus: earliest deadline first, retries, and what an outcome means for the slot.

use clino_bus::{Event, Fault, Master, Micros, Outcome, Protocol, Timing};
use clino_codec::angle::Angle;

use crate::slot::Slot;
use crate::{Source, Status};

mod isu;
mod t7;

/// What makes a slot pollable with protocol `P`: the request, and the angle in its answer.
pub(crate) trait Poll: Protocol {
    fn request(source: &Source) -> Option<(Self::Address, Self::Request)>;
    fn angle(answer: &Self::Answer) -> Result<Angle, Status>;
    /// What a refused answer says about the slot.
    fn refused(error: &Self::DecodeError) -> Status;
}

pub(crate) struct Polling<P: Poll> {
    master: Master<P>,
    asked: Option<Asked>,
}

#[derive(Clone, Copy)]
struct Asked {
    slot: usize,
    tries_left: u8,
    settled: bool,
}

impl<P: Poll> Polling<P> {
    pub fn new(timing: Timing) -> Self {
        Polling { master: Master::new(timing), asked: None }
    }

    pub fn master(&self) -> &Master<P> {
        &self.master
    }

    pub fn on(&mut self, event: Event, slots: &mut [Slot]) {
        let outcome = self.master.on(event);
        self.settle(outcome, slots);
    }

    /// Lets time pass; returns the next frame to submit to the line, if one is due.
    pub fn poll(&mut self, now: Micros, slots: &mut [Slot]) -> Option<P::Frame> {
        let outcome = self.master.poll(now);
        self.settle(outcome, slots);
        if !self.master.is_idle() {
            return None;
        }
        self.asked = match self.asked {
            Some(asked) if !asked.settled => Some(asked),
            _ => self.next_due(now, slots),
        };
        let asked = self.asked?;
        let (address, request) = P::request(&slots.get(asked.slot)?.config.source)?;
        self.master.begin(address, &request, now).ok()
    }

    /// When [`Polling::poll`] has something to do, if ever.
    pub fn poll_at(&self, slots: &[Slot]) -> Option<Micros> {
        match self.master.poll_at() {
            Some(at) => Some(at),
            None => pollable::<P>(slots).map(|(_, slot)| slot.due).min(),
        }
    }

    fn next_due(&self, now: Micros, slots: &mut [Slot]) -> Option<Asked> {
        let (index, due) =
            pollable::<P>(slots).map(|(index, slot)| (index, slot.due)).min_by_key(|&(_, due)| due)?;
        if due > now {
            return None;
        }
        let slot = slots.get_mut(index)?;
        slot.book_next(now);
        Some(Asked { slot: index, tries_left: slot.config.retries, settled: false })
    }

    fn settle(&mut self, outcome: Option<Outcome<P>>, slots: &mut [Slot]) {
        let (Some(outcome), Some(asked)) = (outcome, self.asked.as_mut()) else { return };
        let result = match &outcome.result {
            Ok(answer) => P::angle(answer),
            Err(_) if asked.tries_left > 0 => {
                asked.tries_left = asked.tries_left.saturating_sub(1);
                return;
            }
            Err(fault) => Err(status_of::<P>(fault)),
        };
        asked.settled = true;
        if let Some(slot) = slots.get_mut(asked.slot) {
            slot.settle(result, outcome.at);
        }
    }
}

fn pollable<P: Poll>(slots: &[Slot]) -> impl Iterator<Item = (usize, &Slot)> {
    slots.iter().enumerate().filter(|(_, slot)| P::request(&slot.config.source).is_some())
}

fn status_of<P: Poll>(fault: &Fault<P::DecodeError>) -> Status {
    match fault {
        Fault::NoAnswer { .. } => Status::NoAnswer,
        Fault::Garbled { .. } => Status::BadAnswer,
        Fault::Bad(error) => P::refused(error),
        Fault::NotSent => Status::NotSent,
    }
}
