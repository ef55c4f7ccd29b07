//! The façade: the slots, the two polled buses and the PWM inputs, behind one `poll`. It only forwards; what happens to
//! an event is decided in `bus_task.rs`, `pwm.rs`, `schedule.rs` and `slot.rs`.

#[cfg(feature = "isu")]
use clino_bus::Isu;
use clino_bus::{BusCounters, Duration, Engine, Event, Instant, T7, Timing};
use clino_commissioning::TaskProgress;
use heapless::Vec;

use crate::alarm::{Alarm, AlarmDetail};
use crate::bits::Bits;
use crate::bus_task::{BusTask, Ended, Traffic};
use crate::config::{Bus, MAX_SLOTS, PwmInput, SlotConfig, Source};
use crate::consequence::Consequence;
use crate::counters::SlotCounters;
use crate::degraded::DegradedMode;
use crate::event::{Action, Capture, Requester};
use crate::features;
use crate::order::{Order, Refusal};
use crate::pwm::PwmInputs;
use crate::schedule::outage::BusHealth;
use crate::schedule::{Detail, Polled};
use crate::settings::console::ConsoleSettings;
use crate::settings::{self, BusSettings, SettingsPart, Tabled};
use crate::slot::Slot;
use crate::summary::{BusPart, Standing};
use crate::task::{self, TaskEvent};
use crate::trace::Trace;
use crate::value::{Published, Reading, ReadingBrief, Status};

mod start;

/// The gateway. See the crate documentation.
pub struct Gateway {
    slots: Vec<Polled, MAX_SLOTS>,
    t7: BusTask<T7>,
    #[cfg(feature = "isu")]
    isu: BusTask<Isu>,
    pwm: PwmInputs,
    /// Slots that have changed since they were last fetched.
    changed: Bits,
    /// How often readings were published; wraps.
    generation: u32,
    trace: Trace,
    /// Of all slots' settings together.
    fingerprint: u32,
    degraded: DegradedMode,
    console: ConsoleSettings,
    /// Slots whose alarm *no_value* is on.
    watched: Bits,
    /// When they are looked at next.
    watch_at: Instant,
}

/// From one look at the slots that may have had no value for too long to the next: the settings count in tenths of a
/// second.
const WATCH_EVERY: Duration = Duration::from_millis(100);

/// Seeds that make the fingerprints of slots, buses and console differ; buses have 0 and 1.
const SLOT_SEED: u8 = 2;
const CONSOLE_SEED: u8 = u8::MAX;

/// The only place that selects the task of a bus, for what depends on its protocol; what does not is in its
/// [`Traffic`]. There is always that of the T7s; a bus that is not in this build has none, and nothing asks for it
/// ([`Bus::ALL`]).
macro_rules! on {
    ($gateway:ident, $bus:expr, $task:ident => $does:expr) => {
        match $bus {
            #[cfg(feature = "isu")]
            Bus::Isu => {
                let $task = &$gateway.isu;
                $does
            }
            _ => {
                let $task = &$gateway.t7;
                $does
            }
        }
    };
    (mut $gateway:ident, $bus:expr, $task:ident => $does:expr) => {
        match $bus {
            #[cfg(feature = "isu")]
            Bus::Isu => {
                let $task = &mut $gateway.isu;
                $does
            }
            _ => {
                let $task = &mut $gateway.t7;
                $does
            }
        }
    };
}

impl Gateway {
    fn traffic(&self, bus: Bus) -> &Traffic {
        on!(self, bus, task => task.traffic())
    }

    fn traffic_mut(&mut self, bus: Bus) -> &mut Traffic {
        on!(mut self, bus, task => task.traffic_mut())
    }

    fn engine(&self, bus: Bus) -> &Engine {
        on!(self, bus, task => task.master().engine())
    }

    /// Takes an event of a bus's line.
    pub fn line(&mut self, bus: Bus, event: Event) {
        if !bus.is_built() {
            return;
        }
        let ended = on!(mut self, bus, task => task.on(event, &mut self.slots));
        self.note(bus, ended);
    }

    fn note(&mut self, bus: Bus, ended: Option<Ended>) {
        let restarted = on!(mut self, bus, task => task.take_restarted());
        self.changed = self.changed.or(restarted);
        let Some(Ended { entry, slot }) = ended else { return };
        self.trace.push(entry);
        if let Some(slot) = slot {
            self.changed.set(slot, true);
        }
    }

    /// Takes what a timer input saw at `now`.
    pub fn pwm(&mut self, input: PwmInput, capture: Capture, now: Instant) {
        if !features::PWM {
            return;
        }
        let is_settling = |bus, address| on!(self, bus, task => task.traffic().is_settling(address, now));
        let changed = self.pwm.take(input, capture, now, &mut self.slots, &is_settling);
        self.changed = self.changed.or(changed);
    }

    /// From now on refuses the orders that `degraded` excludes. A task under way goes on.
    pub fn degrade(&mut self, degraded: DegradedMode) {
        self.degraded = degraded;
    }

    /// Carries out an order, whole or not at all.
    ///
    /// # Errors
    /// The [check](Order::check) fails; or the order is [refused in this mode](Gateway::degrade); or [`Refusal::Busy`]: the bus
    /// has a task already, or one with a claim on what would change.
    pub fn carry_out(&mut self, order: Order, requester: Requester) -> Result<(), Refusal> {
        order.check()?;
        order.check_in(self.degraded)?;
        let accepted = match order {
            Order::Slot { slot, config } => self.change_slot(slot.into(), config),
            Order::Bus { bus, change } => self.traffic_mut(bus).change(&change),
            Order::Console(console) => {
                self.console = console;
                true
            }
            Order::ClearCounters => {
                self.clear_counters();
                true
            }
            Order::Acknowledge(slot) => {
                self.acknowledge(slot);
                true
            }
            Order::ClearExtremes(slot) => {
                self.slots_of(slot).for_each(|(_, polled)| polled.slot.clear_extremes());
                true
            }
            Order::T7(task) => self.t7.accept(&task, requester),
            #[cfg(feature = "isu")]
            Order::Isu(task) => self.isu.accept(&task, requester),
            #[cfg(not(feature = "isu"))]
            Order::Isu(_) => false,
            Order::Cancel(bus) => {
                on!(mut self, bus, task => task.cancel());
                true
            }
        };
        if accepted { Ok(()) } else { Err(Refusal::Busy) }
    }

    /// What else an order would change.
    pub fn consequence(&self, order: &Order) -> Consequence {
        let slots = self.slots.iter().map(|polled| polled.slot.config.node());
        Consequence::of(order, self.bus_settings(Bus::T7).timing.serial.baud, slots)
    }

    /// Acknowledges the alarms that wait for it, of one slot or of all.
    fn acknowledge(&mut self, slot: Option<u8>) {
        let mut changed = self.changed;
        for (index, polled) in self.slots_of(slot) {
            if polled.slot.acknowledge() {
                changed.set(index, true);
            }
        }
        self.changed = changed;
    }

    /// One slot, or all, with their numbers.
    fn slots_of(&mut self, slot: Option<u8>) -> impl Iterator<Item = (usize, &mut Polled)> {
        let is_meant = move |index: usize| slot.is_none_or(|slot| usize::from(slot) == index);
        self.slots.iter_mut().enumerate().filter(move |(index, _)| is_meant(*index))
    }

    /// What is known of an alarm of a slot at `now`; `None` while it is quiet, and beyond the last slot.
    pub fn alarm(&self, slot: usize, alarm: Alarm, now: Instant) -> Option<AlarmDetail> {
        self.slots.get(slot)?.slot.alarm(alarm, now)
    }

    /// Changes the named settings of a slot, all or none. The others are read and kept at the same instant.
    ///
    /// # Errors
    /// As of [`Gateway::carry_out`].
    pub fn change(
        &mut self,
        slot: u8,
        named: settings::Named<'_>,
        requester: Requester,
    ) -> Result<(), Refusal> {
        let now = self.config(slot.into()).copied().unwrap_or(SlotConfig::OFF);
        let config = settings::slot::changed(&now, named)?;
        self.carry_out(Order::Slot { slot, config }, requester)
    }

    /// Sets a slot. Returns whether it was set: a task may have a claim on what would change.
    fn change_slot(&mut self, index: usize, config: SlotConfig) -> bool {
        let claims = Bus::ALL.map(|bus| self.traffic(bus).claim());
        // What changes nothing interrupts nothing.
        let Some(now) = self.config(index).filter(|now| **now != config) else { return true };
        if !claims.iter().all(|claim| claim.allows(now, &config)) {
            return false;
        }
        self.configure(index, config);
        true
    }

    /// What a task that has ended has changed, the slots take over.
    #[inline(never)]
    fn conclude(&mut self, bus: Bus) {
        let Some((claim, news)) = self.traffic_mut(bus).ended() else { return };
        for index in 0..self.slots.len() {
            if let Some(config) = self.config(index).and_then(|config| task::followed(config, claim, &news)) {
                self.configure(index, config);
            }
        }
    }

    /// What a task of this requester has found, or how it ended. A task waits until this has been fetched.
    #[inline(never)]
    pub fn task_event(&mut self, requester: Requester) -> Option<TaskEvent> {
        Bus::ALL.into_iter().find_map(|bus| self.traffic_mut(bus).task_event(requester))
    }

    /// Whether [`Gateway::task_event`] has something for this requester.
    pub fn has_task_event(&self, requester: Requester) -> bool {
        Bus::ALL.into_iter().any(|bus| self.traffic(bus).has_task_event(requester))
    }

    /// Whether a task on this bus has said something that was not fetched yet.
    pub(crate) fn holds_task_event(&self, bus: Bus) -> bool {
        self.traffic(bus).holds_task_event()
    }

    /// From now on the slot reads this.
    fn configure(&mut self, index: usize, config: SlotConfig) {
        self.note_settings(index);
        if let Some(polled) = self.slots.get_mut(index) {
            polled.set(config);
        }
        self.note_settings(index);
        self.reset(index);
    }

    /// A slot means something else now.
    fn reset(&mut self, index: usize) {
        let Some(Polled { slot: Slot { config, .. }, .. }) = self.slots.get(index) else { return };
        for bus in Bus::ALL {
            on!(mut self, bus, task => task.traffic_mut().forget(index, config));
        }
        self.watched.set(index, config.enabled && config.source != Source::Off && config.alarm.no_value > 0);
        self.changed.set(index, true);
        let changed = self.pwm.forget(index, &mut self.slots);
        self.changed = self.changed.or(changed);
    }

    /// How far the task on a bus is, if there is one.
    pub fn progress(&self, bus: Bus) -> Option<TaskProgress> {
        on!(self, bus, task => task.progress())
    }

    /// Lets time pass on a bus; `port` is called with what it has to do, in this order.
    pub fn poll(&mut self, bus: Bus, now: Instant, port: impl FnMut(Action<'_>)) {
        if !bus.is_built() {
            return;
        }
        // This runs with each character on any bus.
        if now >= on!(self, bus, task => task.due()) {
            let ended = on!(mut self, bus, task => task.poll(now, &mut self.slots, port));
            self.note(bus, ended);
            if self.traffic(bus).has_ended() {
                self.conclude(bus);
            }
        }
        if !self.watched.is_empty() && now >= self.watch_at {
            self.watch(now);
        }
    }

    /// Looks whether a slot has had no value for too long.
    #[inline(never)]
    fn watch(&mut self, now: Instant) {
        self.watch_at = now + WATCH_EVERY;
        for index in self.watched.iter() {
            if self.slots.get_mut(index).is_some_and(|polled| polled.slot.watch(now)) {
                self.changed.set(index, true);
            }
        }
    }

    /// When [`Gateway::poll`] has something to do on `bus`, if ever.
    pub fn poll_at(&self, bus: Bus) -> Option<Instant> {
        let due = on!(self, bus, task => task.due());
        let next = if self.watched.is_empty() { due } else { due.min(self.watch_at) };
        (next != Instant::NEVER).then_some(next)
    }

    /// A reading that has changed since it was last returned here, or published.
    pub fn next_changed(&mut self) -> Option<Reading> {
        let index = self.changed.iter().next()?;
        self.changed.set(index, false);
        self.reading(index)
    }

    /// Publishes the readings that have changed since they were last published or returned: what has come is made into
    /// angles, and alarms are looked at. Returns whether there were any; they are a new [generation](Gateway::generation). A
    /// function of its own: its stack is not below the exchanges.
    #[inline(never)]
    pub fn publish(&mut self) -> bool {
        let changed = core::mem::take(&mut self.changed);
        if changed.is_empty() {
            return false;
        }
        for index in changed.iter() {
            _ = self.digested(index);
        }
        self.generation = self.generation.wrapping_add(1);
        true
    }

    /// Counts the generations of readings; wraps. What is read before and after is of one generation if this is the same.
    pub fn generation(&self) -> u32 {
        self.generation
    }

    /// A slot with the angle of what has come last; `None` beyond the last one.
    fn digested(&mut self, slot: usize) -> Option<&Slot> {
        let Polled { slot, .. } = self.slots.get_mut(slot)?;
        slot.digest();
        Some(slot)
    }

    /// The last reading of a slot; `None` beyond the last one.
    pub fn reading(&mut self, slot: usize) -> Option<Reading> {
        let number = u8::try_from(slot).ok()?;
        self.digested(slot).map(|slot| slot.reading(number))
    }

    // Parts of a reading, for who asks for many slots at once.

    /// What the value of a slot is worth at `now`; `None` beyond the last one.
    pub fn status(&mut self, slot: usize, now: Instant) -> Option<Status> {
        self.digested(slot).map(|slot| slot.status(now))
    }

    /// The angle of a slot as it is published, if it is right and fresh at `now`.
    pub fn angle(&mut self, slot: usize, now: Instant) -> Option<Published> {
        self.digested(slot)?.angle(now)
    }

    /// Time since the last good value of a slot was received, in milliseconds, if there was one.
    pub fn age_ms(&mut self, slot: usize, now: Instant) -> Option<u64> {
        self.digested(slot)?.age_ms(now)
    }

    /// What a slot declares at `now`. `None` beyond the last one.
    pub fn standing(&mut self, slot: usize, now: Instant) -> Option<Standing> {
        self.digested(slot).map(|slot| slot.standing(now))
    }

    /// The least of a reading, as of `now`. `None` beyond the last one.
    pub fn brief(&mut self, slot: usize, now: Instant) -> Option<ReadingBrief> {
        self.digested(slot).map(|slot| slot.brief(now))
    }

    /// How a slot is set; `None` beyond the last one.
    pub fn config(&self, slot: usize) -> Option<&SlotConfig> {
        self.slots.get(slot).map(|polled| &polled.slot.config)
    }

    /// What happened to a slot since it was set; `None` beyond the last one.
    pub fn slot_counters(&self, slot: usize) -> Option<&SlotCounters> {
        self.slots.get(slot).map(|polled| &polled.slot.counters)
    }

    /// What is known of a slot besides its value; `None` beyond the last one.
    #[inline(never)]
    pub fn detail(&self, slot: usize) -> Option<Detail> {
        self.slots.get(slot).map(Polled::detail)
    }

    /// How a bus is set. In force, or before its next exchange.
    pub fn bus_settings(&self, bus: Bus) -> &BusSettings {
        self.traffic(bus).settings()
    }

    /// Whether the bus runs as it is set. A bit rate that a task has chosen for a while does not count.
    pub fn is_in_force(&self, bus: Bus) -> bool {
        self.traffic(bus).is_in_force()
    }

    /// How the console behaves.
    pub fn console_settings(&self) -> ConsoleSettings {
        self.console
    }

    /// A number that is the same whenever all settings are the same, and hardly ever otherwise.
    pub fn fingerprint(&self) -> u32 {
        SettingsPart::together(|part| self.fingerprint_of(part))
    }

    /// The number of a part. Who locks the gateway locks it for one part after the other: meanwhile no driver rises.
    pub fn fingerprint_of(&self, part: SettingsPart) -> u32 {
        match part {
            SettingsPart::Slots => self.fingerprint,
            SettingsPart::Console => {
                let table = &settings::console::SETTINGS;
                settings::fingerprint(&Tabled::new(table, &self.console), CONSOLE_SEED)
            }
            SettingsPart::Bus(bus) => {
                let table = settings::bus::settings(bus);
                settings::fingerprint(&Tabled::new(table, self.bus_settings(bus)), bus as u8)
            }
        }
    }

    /// To be called before a slot's settings change, and again when they have.
    fn note_settings(&mut self, index: usize) {
        let Some(config) = self.config(index) else { return };
        let seed = SLOT_SEED.wrapping_add(index as u8);
        self.fingerprint ^= settings::fingerprint(&Tabled::new(&settings::slot::SETTINGS, config), seed);
    }

    /// Sets what was counted to zero, of all slots and of both buses.
    pub fn clear_counters(&mut self) {
        for Polled { slot, .. } in &mut self.slots {
            slot.counters = SlotCounters::default();
        }
        for bus in Bus::ALL {
            on!(mut self, bus, task => task.clear_counters());
        }
    }

    /// The last transactions of both buses.
    pub fn trace(&self) -> &Trace {
        &self.trace
    }

    /// What happened on a bus since reset.
    pub fn counters(&self, bus: Bus) -> &BusCounters {
        self.engine(bus).counters()
    }

    /// How a bus as a whole is doing.
    pub fn health(&self, bus: Bus) -> BusHealth {
        self.traffic(bus).health()
    }

    /// What a bus declares.
    pub fn part(&self, bus: Bus) -> BusPart {
        let task = self.progress(bus).is_some() || self.holds_task_event(bus);
        BusPart { fault: self.health(bus).fault, forced: self.counters(bus).forced > 0, task }
    }

    /// How a bus runs now.
    pub fn timing(&self, bus: Bus) -> &Timing {
        self.engine(bus).timing()
    }

    /// PWM cycles that were dropped because an edge was lost, both inputs together.
    pub fn lost_edges(&self) -> u32 {
        self.pwm.lost_edges()
    }
}

#[cfg(test)]
mod tests;
