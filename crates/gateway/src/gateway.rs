//! The slots, the two polled buses and the PWM inputs, behind one `poll`.

use clino_bus::{Counters, Event, Isu, Micros, T7, Timing};
use clino_codec::pwm::{self, Ticks};
use heapless::Vec;

use crate::config::{Bus, MAX_SLOTS, PwmInput, SlotConfig, Source};
use crate::polling::Polling;
use crate::slot::Slot;
use crate::value::{Reading, Status};

/// What a timer input saw. Raw: the law that makes an angle of it is the codec's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Capture {
    /// One whole cycle, rising edge to rising edge.
    Cycle(Ticks),
    /// An edge was not read before the next one overwrote it; the cycle is not trustworthy.
    LostEdge,
    /// No edge for longer than any legal period; the pin sits at this level.
    NoSignal {
        /// The pin is high.
        high: bool,
    },
}

/// The gateway. See the crate documentation.
pub struct Gateway {
    slots: Vec<Slot, MAX_SLOTS>,
    t7: Polling<T7>,
    isu: Polling<Isu>,
    pwm: pwm::Limits,
    lost_edges: u32,
}

impl Gateway {
    /// A gateway that has read nothing yet. Entries of `table` beyond [`MAX_SLOTS`] are left out.
    pub fn new(table: &[SlotConfig], t7: Timing, isu: Timing, pwm: pwm::Limits) -> Gateway {
        Gateway {
            slots: table.iter().take(MAX_SLOTS).copied().map(Slot::new).collect(),
            t7: Polling::new(t7),
            isu: Polling::new(isu),
            pwm,
            lost_edges: 0,
        }
    }

    /// Takes an event of a bus's line.
    pub fn line(&mut self, bus: Bus, event: Event) {
        match bus {
            Bus::T7 => self.t7.on(event, &mut self.slots),
            Bus::Isu => self.isu.on(event, &mut self.slots),
        }
    }

    /// Takes what a timer input saw at `now`.
    pub fn pwm(&mut self, input: PwmInput, capture: Capture, now: Micros) {
        let result = match capture {
            Capture::Cycle(ticks) => pwm::measure(ticks, &self.pwm, pwm::Law::Documented)
                .map(|reading| reading.angle)
                .map_err(|fault| match fault {
                    pwm::PwmFault::Period { .. } => Status::BadPeriod,
                    _ => Status::OutOfRange,
                }),
            Capture::LostEdge => {
                self.lost_edges = self.lost_edges.wrapping_add(1);
                return;
            }
            Capture::NoSignal { high: true } => Err(Status::StuckHigh),
            Capture::NoSignal { high: false } => Err(Status::StuckLow),
        };
        for slot in self.slots.iter_mut().filter(|slot| slot.config.source == Source::Pwm { input }) {
            slot.settle(result, now);
        }
    }

    /// Lets time pass on a bus: `send` is given the next frame for the bus's line, if one is due.
    pub fn poll(&mut self, bus: Bus, now: Micros, send: impl FnOnce(&[u8])) {
        match bus {
            Bus::T7 => self.t7.poll(now, &mut self.slots).map(|frame| send(frame.as_ref())),
            Bus::Isu => self.isu.poll(now, &mut self.slots).map(|frame| send(frame.as_ref())),
        };
    }

    /// When [`Gateway::poll`] has something to do on `bus`, if ever.
    pub fn poll_at(&self, bus: Bus) -> Option<Micros> {
        match bus {
            Bus::T7 => self.t7.poll_at(&self.slots),
            Bus::Isu => self.isu.poll_at(&self.slots),
        }
    }

    /// A reading that has changed since it was last returned here.
    pub fn next_changed(&mut self) -> Option<Reading> {
        let (index, slot) = self.slots.iter_mut().enumerate().find(|(_, slot)| slot.changed)?;
        slot.changed = false;
        Some(slot.reading(u8::try_from(index).unwrap_or(u8::MAX)))
    }

    /// What happened on a bus since reset.
    pub fn counters(&self, bus: Bus) -> &Counters {
        match bus {
            Bus::T7 => self.t7.master().counters(),
            Bus::Isu => self.isu.master().counters(),
        }
    }

    /// PWM cycles that were dropped because an edge was lost, both inputs together.
    pub fn lost_edges(&self) -> u32 {
        self.lost_edges
    }
}

#[cfg(test)]
mod tests;
