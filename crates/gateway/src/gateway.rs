//! The slots, the two polled buses and the PWM inputs, behind one `poll`.

use clino_bus::{Counters, Event, Isu, Micros, T7, Timing, line};
use clino_codec::pwm::{self, Ticks};
use clino_commissioning::Progress;
use heapless::Vec;

use crate::bits::Bits;
use crate::config::{Bus, MAX_SLOTS, PwmInput, SlotConfig, Source};
use crate::counters::SlotCounters;
use crate::order::{Order, Refusal};
use crate::outage::BusHealth;
use crate::restraint::Restraint;
use crate::settings::console::ConsoleSettings;
use crate::settings::{self, BusSettings};
use crate::slot::{Sample, Slot};
use crate::snapshot::Publisher;
use crate::task::News;
use crate::trace::Trace;
use crate::traffic::{Ended, Traffic};
use crate::value::{Reading, Status};

mod partners;
mod start;

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

/// What a bus's port has to do for the gateway.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action<'a> {
    /// Send this frame.
    Send(&'a [u8]),
    /// Run with this bit rate and these waits from now on.
    Run(Timing, line::Settings),
}

/// Who gives an order. What comes of a task is told to whom it belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Asker {
    /// Whoever is at the console.
    Console,
    /// The Modbus master.
    Modbus,
}

/// What is known of a slot besides its value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Detail {
    /// What happened to its requests.
    pub counters: SlotCounters,
    /// How the last reading that failed did; `None` if none has.
    pub last_error: Option<Status>,
    /// It does not answer, and is asked less often.
    pub is_dead: bool,
    /// A value has come that a second one has to confirm.
    pub awaits_confirmation: bool,
}

/// The gateway. See the crate documentation.
pub struct Gateway {
    slots: Vec<Slot, MAX_SLOTS>,
    t7: Traffic<T7>,
    isu: Traffic<Isu>,
    pwm: pwm::Limits,
    lost_edges: u32,
    /// Slots that have changed since they were last fetched.
    changed: Bits,
    /// Slots that read a PWM input.
    listening: Bits,
    trace: Trace,
    /// Of all slots' settings together.
    fingerprint: u32,
    restraint: Restraint,
    console: ConsoleSettings,
}

/// What tells the fingerprints of things apart; buses have 0 and 1.
const SLOT_SEED: u8 = 2;
const CONSOLE_SEED: u8 = u8::MAX;

/// Two PWM cycles this close are the same, in µ°: two steps of 4.34 µs.
const PWM_RESOLUTION: u32 = 180_000;

impl Gateway {
    /// Takes an event of a bus's line.
    pub fn line(&mut self, bus: Bus, event: Event) {
        let ended = match bus {
            Bus::T7 => self.t7.on(event, &mut self.slots),
            Bus::Isu => self.isu.on(event, &mut self.slots),
        };
        self.note(ended);
    }

    fn note(&mut self, ended: Option<Ended>) {
        self.changed = self.changed.or(self.t7.take_restarted()).or(self.isu.take_restarted());
        let Some(Ended { entry, slot }) = ended else { return };
        self.trace.push(entry);
        if let Some(slot) = slot {
            self.changed.set(slot, true);
        }
    }

    /// Takes what a timer input saw at `now`.
    pub fn pwm(&mut self, input: PwmInput, capture: Capture, now: Micros) {
        let result = match capture {
            Capture::Cycle(ticks) => pwm::measure(ticks, &self.pwm, pwm::Law::Documented)
                .map(|reading| Sample::new(reading.angle))
                .map_err(|fault| match fault {
                    pwm::PwmFault::Period { .. } => Status::BadPeriod,
                    _ => Status::OutOfRange,
                }),
            Capture::LostEdge => {
                self.lost_edges = self.lost_edges.wrapping_add(1);
                Err(Status::NoSignal)
            }
            Capture::NoSignal { high: true } => Err(Status::StuckHigh),
            Capture::NoSignal { high: false } => Err(Status::StuckLow),
        };
        let settling = self.settling_inputs(now);
        for index in self.listening.iter() {
            let Some(slot) = self.slots.get_mut(index).filter(|slot| slot.is(&Source::Pwm { input })) else {
                continue;
            };
            // One cycle without its edge is no fault yet.
            if capture == Capture::LostEdge && !slot.is_stale(now) {
                continue;
            }
            if result.is_err() {
                slot.shake();
            }
            if result.is_ok() && settling.has(index) {
                continue;
            }
            if slot.settle(result, now, true, PWM_RESOLUTION) {
                self.changed.set(index, true);
            }
            self.compare(index, now);
        }
    }

    /// From now on refuses what does not go with these times. A task under way goes on.
    pub fn restrain(&mut self, restraint: Restraint) {
        self.restraint = restraint;
    }

    /// Carries out an order, whole or not at all.
    ///
    /// # Errors
    /// The [check](Order::check) has something against it; or it is [restrained](Gateway::restrain); or [`Refusal::Busy`]:
    /// the bus has a task already, or has one that works on what is to change.
    pub fn carry_out(&mut self, order: Order, asker: Asker) -> Result<(), Refusal> {
        order.check()?;
        self.restraint.check(&order)?;
        let accepted = match order {
            Order::Slot { slot, config } => self.change_slot(slot.into(), config),
            Order::Bus { bus: Bus::T7, change } => self.t7.change(&change),
            Order::Bus { bus: Bus::Isu, change } => self.isu.change(&change),
            Order::Console(console) => {
                self.console = console;
                true
            }
            Order::ClearCounters => {
                self.clear_counters();
                true
            }
            Order::T7(task) => self.t7.accept(&task, asker),
            Order::Isu(task) => self.isu.accept(&task, asker),
            Order::Cancel(bus) => {
                match bus {
                    Bus::T7 => self.t7.cancel(),
                    Bus::Isu => self.isu.cancel(),
                }
                true
            }
        };
        if accepted { Ok(()) } else { Err(Refusal::Busy) }
    }

    /// Changes what is named of a slot, whole or not at all. What is not named is read and kept in the same moment.
    ///
    /// # Errors
    /// As of [`Gateway::carry_out`].
    pub fn change(&mut self, slot: u8, named: settings::Named<'_>, asker: Asker) -> Result<(), Refusal> {
        let now = self.config(slot.into()).copied().unwrap_or(SlotConfig::OFF);
        let config = settings::slot::changed(&now, named)?;
        self.carry_out(Order::Slot { slot, config }, asker)
    }

    /// The slot is to be like this. Returns whether it is: a task may work on what would change.
    fn change_slot(&mut self, index: usize, config: SlotConfig) -> bool {
        let claims = [self.t7.claim(), self.isu.claim()];
        // What changes nothing interrupts nothing.
        let Some(now) = self.config(index).filter(|now| **now != config) else { return true };
        if !claims.iter().all(|claim| claim.allows(now, &config)) {
            return false;
        }
        self.configure(index, config);
        true
    }

    /// What a task that has ended has changed, the slots take over.
    fn conclude(&mut self, bus: Bus) {
        let ended = match bus {
            Bus::T7 => self.t7.ended(),
            Bus::Isu => self.isu.ended(),
        };
        let Some((claim, news)) = ended else { return };
        for index in 0..self.slots.len() {
            if let Some(config) = self.slots.get(index).and_then(|slot| slot.follow(claim, &news)) {
                self.configure(index, config);
            }
        }
    }

    /// What a task of this asker has found, or how it ended. A task waits until this has been fetched.
    pub fn news(&mut self, asker: Asker) -> Option<News> {
        self.t7.news(asker).or_else(|| self.isu.news(asker))
    }

    /// Whether [`Gateway::news`] has something for this asker.
    pub fn has_news(&self, asker: Asker) -> bool {
        self.t7.has_news(asker) || self.isu.has_news(asker)
    }

    /// Whether a task on this bus has said something that was not fetched yet.
    pub(crate) fn holds_news(&self, bus: Bus) -> bool {
        [Asker::Console, Asker::Modbus].into_iter().any(|asker| match bus {
            Bus::T7 => self.t7.has_news(asker),
            Bus::Isu => self.isu.has_news(asker),
        })
    }

    /// From now on the slot reads this.
    fn configure(&mut self, index: usize, config: SlotConfig) {
        self.note_settings(index);
        if let Some(slot) = self.slots.get_mut(index) {
            slot.set(config);
        }
        self.note_settings(index);
        self.reset(index);
    }

    /// A slot means something else now.
    fn reset(&mut self, index: usize) {
        let Some(slot) = self.slots.get(index) else { return };
        self.t7.forget(index, slot);
        self.isu.forget(index, slot);
        self.listening.set(index, listens(slot));
        self.changed.set(index, true);
        self.forget_partner(index);
    }

    /// How far the task on a bus is, if there is one.
    pub fn progress(&self, bus: Bus) -> Option<Progress> {
        match bus {
            Bus::T7 => self.t7.progress(),
            Bus::Isu => self.isu.progress(),
        }
    }

    /// Lets time pass on a bus; `port` is told what it has to do, in this order.
    pub fn poll(&mut self, bus: Bus, now: Micros, port: impl FnMut(Action<'_>)) {
        let ended = match bus {
            Bus::T7 => self.t7.poll(now, &mut self.slots, port),
            Bus::Isu => self.isu.poll(now, &mut self.slots, port),
        };
        self.note(ended);
        self.conclude(bus);
    }

    /// When [`Gateway::poll`] has something to do on `bus`, if ever.
    pub fn poll_at(&self, bus: Bus) -> Option<Micros> {
        match bus {
            Bus::T7 => self.t7.poll_at(),
            Bus::Isu => self.isu.poll_at(),
        }
    }

    /// A reading that has changed since it was last returned here, or published.
    pub fn next_changed(&mut self) -> Option<Reading> {
        let index = self.changed.iter().next()?;
        self.changed.set(index, false);
        self.slots.get_mut(index)?.digest();
        self.reading(index)
    }

    /// Publishes the readings that have changed since they were last published or returned, all at once. Returns whether
    /// there were any.
    pub fn publish(&mut self, publisher: &mut Publisher<'_>) -> bool {
        let changed = core::mem::take(&mut self.changed);
        if changed.is_empty() {
            return false;
        }
        for index in changed.iter() {
            if let Some(slot) = self.slots.get_mut(index) {
                slot.digest();
            }
        }
        publisher.publish(changed, |index| self.reading(index));
        true
    }

    fn reading(&self, index: usize) -> Option<Reading> {
        let number = u8::try_from(index).ok()?;
        self.slots.get(index).map(|slot| slot.reading(number))
    }

    /// How a slot is set; `None` beyond the last one.
    pub fn config(&self, slot: usize) -> Option<&SlotConfig> {
        self.slots.get(slot).map(|slot| &slot.config)
    }

    /// What happened to a slot since it was set; `None` beyond the last one.
    pub fn slot_counters(&self, slot: usize) -> Option<&SlotCounters> {
        self.slots.get(slot).map(|slot| &slot.counters)
    }

    /// What is known of a slot besides its value; `None` beyond the last one.
    pub fn detail(&self, slot: usize) -> Option<Detail> {
        self.slots.get(slot).map(Slot::detail)
    }

    /// How a bus is set. In force, or as soon as no exchange is in hand.
    pub fn bus_settings(&self, bus: Bus) -> &BusSettings {
        match bus {
            Bus::T7 => self.t7.settings(),
            Bus::Isu => self.isu.settings(),
        }
    }

    /// Whether the bus runs as it is set. A bit rate that a task has chosen for a while does not count.
    pub fn is_in_force(&self, bus: Bus) -> bool {
        match bus {
            Bus::T7 => self.t7.is_in_force(),
            Bus::Isu => self.isu.is_in_force(),
        }
    }

    /// How the console behaves.
    pub fn console_settings(&self) -> ConsoleSettings {
        self.console
    }

    /// A number that is the same whenever all settings are the same, and hardly ever otherwise.
    pub fn fingerprint(&self) -> u32 {
        let bus =
            |bus| settings::fingerprint(settings::bus::settings(bus), self.bus_settings(bus), bus as u8);
        let console = settings::fingerprint(&settings::console::SETTINGS, &self.console, CONSOLE_SEED);
        self.fingerprint ^ bus(Bus::T7) ^ bus(Bus::Isu) ^ console
    }

    /// To be called before a slot's settings change, and again when they have.
    fn note_settings(&mut self, index: usize) {
        let Some(slot) = self.slots.get(index) else { return };
        let seed = SLOT_SEED.wrapping_add(index as u8);
        self.fingerprint ^= settings::fingerprint(&settings::slot::SETTINGS, &slot.config, seed);
    }

    /// Sets what was counted to zero, of all slots and of both buses.
    pub fn clear_counters(&mut self) {
        for slot in &mut self.slots {
            slot.counters = SlotCounters::default();
        }
        self.t7.clear_counters();
        self.isu.clear_counters();
    }

    /// The last transactions of both buses.
    pub fn trace(&self) -> &Trace {
        &self.trace
    }

    /// What happened on a bus since reset.
    pub fn counters(&self, bus: Bus) -> &Counters {
        match bus {
            Bus::T7 => self.t7.master().counters(),
            Bus::Isu => self.isu.master().counters(),
        }
    }

    /// How a bus as a whole is doing.
    pub fn health(&self, bus: Bus) -> BusHealth {
        match bus {
            Bus::T7 => self.t7.health(),
            Bus::Isu => self.isu.health(),
        }
    }

    /// How a bus runs now.
    pub fn timing(&self, bus: Bus) -> &Timing {
        match bus {
            Bus::T7 => self.t7.master().timing(),
            Bus::Isu => self.isu.master().timing(),
        }
    }

    /// PWM cycles that were dropped because an edge was lost, both inputs together.
    pub fn lost_edges(&self) -> u32 {
        self.lost_edges
    }
}

/// Whether a slot reads a PWM input.
fn listens(slot: &Slot) -> bool {
    slot.config.enabled && matches!(slot.config.source, Source::Pwm { .. })
}

#[cfg(test)]
mod tests;
