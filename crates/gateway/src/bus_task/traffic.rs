//! The traffic of one bus, whatever its protocol: one copy for all of them. What passes through the protocol's types is in
//! [`BusTask`](super::BusTask).

use clino_bus::line::LineSettings;
use clino_bus::{Engine, Fault, Instant, Serial, Timing};
use clino_codec::checks::Check;

use super::Ended;
use super::polling::{Content, PollRules, Polling, Said};
use crate::bits::Bits;
use crate::counters::{SlotCounters, bump16};
use crate::event::Requester;
use crate::features::COMMISSIONING;
use crate::schedule::Polled;
use crate::schedule::outage::BusHealth;
use crate::schedule::queue::Asked;
use crate::schedule::settling::{Nodes, Settling, readers};
use crate::settings::{BusChange, BusSettings};
use crate::task::{Claim, TaskEvent};
use crate::trace::{Entry, Purpose, Verdict};
use crate::{Bus, SlotConfig, Status};

/// A reading that went well.
struct Answered {
    asked: Asked,
    said: Said,
    at: Instant,
    entry: Entry,
}

pub(crate) struct Traffic {
    pub(super) polling: Polling,
    /// The exchange under way.
    begun: Entry,
    /// A reading that went well. What it says can wait until the next request is on its way.
    answer: Option<Answered>,
    /// Of the task that was accepted, until it has ended.
    claim: Option<Claim>,
    /// The task is to stop before it has begun.
    pub(super) cancelled: bool,
    /// The requester of the task, or of the last one.
    requester: Requester,
    /// Not fetched yet; the next task waits until it is.
    pub(super) news: Option<TaskEvent>,
    /// How the bus is to run.
    settings: BusSettings,
    /// The line does not run like this yet.
    pub(super) pending: bool,
    /// The task has changed the bit rate: what went over the line since ended then.
    disturbed: Option<Instant>,
    pub(super) task_is_next: bool,
    settling: Settling,
    /// Slots that were restarted since they were last taken.
    restarted: Bits,
}

impl Traffic {
    /// A bus that reads nothing.
    #[inline(always)]
    pub fn idle(rules: &'static PollRules, timing: Timing) -> Self {
        Traffic {
            polling: Polling::idle(rules),
            begun: Entry::begun(Instant::ZERO, rules.bus, (0, 0), Purpose::Task),
            answer: None,
            claim: None,
            cancelled: false,
            requester: Requester::Console,
            news: None,
            settings: BusSettings::new(timing),
            pending: false,
            disturbed: None,
            task_is_next: false,
            settling: Settling::default(),
            restarted: Bits::EMPTY,
        }
    }

    fn bus(&self) -> Bus {
        self.polling.rules().bus
    }

    /// The bus runs like this from the beginning.
    pub fn set_up(&mut self, settings: &BusSettings) {
        self.settings = *settings;
        // The port runs without delays and echo until it gets other settings.
        self.pending = settings.line != settings.timing.line();
    }

    /// These settings are to change. Returns whether they do: the bit rate may be a task's.
    pub fn change(&mut self, change: &BusChange) -> bool {
        let settings = self.settings.with(self.bus(), change);
        if let Some(claim) = self.claim
            && change.baud.is_some()
            && (settings.timing.serial != self.settings.timing.serial || claim == Claim::BitRate)
        {
            return false;
        }
        if settings != self.settings {
            self.settings = settings;
            self.pending = true;
        }
        true
    }

    /// Accepts a task with this claim, unless there is one.
    pub fn accept(&mut self, claim: Claim, requester: Requester) -> bool {
        let idle = COMMISSIONING && self.claim.is_none() && self.news.is_none();
        if idle {
            (self.claim, self.requester, self.cancelled) = (Some(claim), requester, false);
        }
        idle
    }

    /// Whether there is a task that has not ended.
    pub fn has_task(&self) -> bool {
        self.claim.is_some()
    }

    /// What the task that was accepted works on.
    pub fn claim(&self) -> Claim {
        self.claim.unwrap_or(Claim::Nothing)
    }

    /// Whether a task has just ended.
    pub fn has_ended(&self) -> bool {
        COMMISSIONING && self.claim.is_some() && self.news.as_ref().is_some_and(TaskEvent::is_end)
    }

    /// The claim of a task that has just ended, and how it has ended; once.
    pub fn ended(&mut self) -> Option<(Claim, TaskEvent)> {
        let news = self.news.as_ref().filter(|news| COMMISSIONING && news.is_end())?;
        self.claim.take().map(|claim| (claim, *news))
    }

    /// The event of the task, if this requester has ordered it.
    pub fn task_event(&mut self, requester: Requester) -> Option<TaskEvent> {
        self.news.take_if(|_| COMMISSIONING && self.requester == requester)
    }

    /// Whether the task has an event for this requester.
    pub fn has_task_event(&self, requester: Requester) -> bool {
        COMMISSIONING && self.news.is_some() && self.requester == requester
    }

    /// Whether the task has an event that was not fetched yet.
    pub fn holds_task_event(&self) -> bool {
        self.news.is_some()
    }

    /// How the bus is set. A bit rate that a task has chosen for a while is not among it.
    pub fn settings(&self) -> &BusSettings {
        &self.settings
    }

    /// Whether the line runs like this, but for the bit rate of a task.
    pub fn is_in_force(&self) -> bool {
        !self.pending
    }

    /// The numbers of these nodes mean something else from now on, by `until` at the latest: what was kept of them is
    /// forgotten, and answers to requests before that are not used.
    #[inline(never)]
    fn meaning_changed(&mut self, nodes: Nodes, until: Instant, now: Instant, slots: &mut [Polled]) {
        self.settling.add(nodes, until, now);
        let readers = readers(slots, self.bus(), nodes);
        for index in readers.iter() {
            if let Some(polled) = slots.get_mut(index) {
                polled.restart();
            }
        }
        self.restarted = self.restarted.or(readers);
    }

    /// Whether the answer of the node at this address to a request of `asked` is not used yet.
    pub fn is_settling(&self, address: u8, asked: Instant) -> bool {
        self.settling.holds(Nodes::at(self.bus(), address), asked)
    }

    /// The slots that were restarted since this was last called.
    pub fn take_restarted(&mut self) -> Bits {
        core::mem::replace(&mut self.restarted, Bits::EMPTY)
    }

    /// Sets what was counted to zero.
    pub fn clear_counters(&mut self) {
        self.polling.clear_counters();
    }

    /// How the bus as a whole is doing.
    pub fn health(&self) -> BusHealth {
        self.polling.health()
    }

    /// The slot is set anew: an answer that is still to come for it is discarded.
    pub fn forget(&mut self, index: usize, config: &SlotConfig) {
        self.answer.take_if(|answer| answer.asked.slot == index);
        self.polling.forget(index, config);
    }

    /// The request that has just begun goes to the line.
    pub(super) fn begin(&mut self, engine: &Engine, purpose: Purpose, now: Instant) {
        let expected = engine.expected();
        self.begun = Entry::begun(now, self.bus(), (expected.node, expected.command), purpose);
    }

    /// The exchange under way has ended so.
    fn end(&self, verdict: Verdict, at: Instant) -> Entry {
        self.begun.ended(at, verdict)
    }

    /// A reading has ended with an answer: the slot that it is for.
    #[inline(never)]
    pub(super) fn answered(&mut self, engine: &Engine, at: Instant, slots: &mut [Polled]) -> Option<Asked> {
        self.polling.end(engine, at, slots)
    }

    /// What that answer contains. It is used when the next request is on its way.
    #[inline(never)]
    pub(super) fn keep(&mut self, asked: Asked, content: Content, at: Instant, slots: &mut [Polled]) {
        let said = match content {
            Content::Sample(sample) => Ok(Some(sample)),
            Content::Nothing(status) => Err(status),
            Content::Identity(identity) => match slots.get_mut(asked.slot) {
                Some(polled) => polled.slot.identify(identity).map(|()| None),
                None => Ok(None),
            },
        };
        let entry = self.end(Verdict::Good, at);
        self.answer = Some(Answered { asked, said, at, entry });
    }

    /// A reading has failed, and its slot has this status.
    #[inline(never)]
    pub(super) fn failed(
        &mut self,
        engine: &Engine,
        fault: &Fault<Check>,
        status: Status,
        at: Instant,
        slots: &mut [Polled],
    ) -> Ended {
        let entry = self.end(Verdict::of_fault(fault), at);
        Ended { entry, slot: self.polling.fail(engine, fault, status, at, slots) }
    }

    /// An exchange of the task has ended: well, or with a fault.
    #[inline(never)]
    pub(super) fn task_settled(
        &mut self,
        engine: &Engine,
        fault: Option<&Fault<Check>>,
        at: Instant,
        slots: &mut [Polled],
    ) -> Ended {
        if fault.is_none() {
            self.polling.heard(engine, at, slots);
        }
        self.disturbed = self.disturbed.map(|_| at);
        self.settling.sent(at + self.polling.rules().settles);
        Ended { entry: self.end(fault.map_or(Verdict::Good, Verdict::of_fault), at), slot: None }
    }

    /// Takes the content of a reading that went well, if there is one.
    #[inline]
    pub(super) fn take(&mut self, engine: &Engine, slots: &mut [Polled]) -> Option<Ended> {
        if self.answer.is_some() { self.take_answer(engine, slots) } else { None }
    }

    #[inline(never)]
    fn take_answer(&mut self, engine: &Engine, slots: &mut [Polled]) -> Option<Ended> {
        let Answered { asked, said, at, entry } = self.answer.take()?;
        let node = slots.get(asked.slot).and_then(|polled| polled.slot.config.source.node());
        let address = node.map_or(0, |(_, address)| address);
        let serial = said.as_ref().ok().and_then(|sample| sample.as_ref()?.serial);
        if let Some((polled, serial)) = slots.get_mut(asked.slot).zip(serial)
            && polled.turn.sensor.is_replaced_by(serial)
        {
            self.meaning_changed(Nodes::at(self.bus(), address), Instant::ZERO, at, slots);
        }
        let used = !self.is_settling(address, asked.since);
        Some(Ended { entry, slot: self.polling.take(engine, &asked, said, used, at, slots) })
    }

    /// A request of the task goes to the line. `wrote` says that it changes non-volatile memory, `alters` that it may change
    /// what the node's angle means.
    #[inline(never)]
    pub(super) fn begin_for_task(
        &mut self,
        engine: &Engine,
        (wrote, alters): (bool, bool),
        now: Instant,
        slots: &mut [Polled],
    ) {
        let address = engine.expected().node;
        if wrote {
            self.count(slots, address, |counters| &mut counters.writes);
        }
        if alters {
            self.alter(address, now, slots);
        }
        self.begin(engine, Purpose::Task, now);
    }

    /// The task's next request may change the node at this address.
    fn alter(&mut self, address: u8, now: Instant, slots: &mut [Polled]) {
        let destination = match self.claim() {
            Claim::Addresses(bus, [_, to]) => Nodes::at(bus, to),
            _ => Nodes::NONE,
        };
        let nodes = Nodes::at(self.bus(), address).and(destination);
        self.settling.begin(nodes, now);
        self.meaning_changed(nodes, now, now, slots);
    }

    /// The task has changed the bit rate.
    pub(super) fn disturb(&mut self, now: Instant) {
        self.disturbed = Some(now);
    }

    /// A task has ended: the bit rate stays as it has left it. Nodes at this rate may have taken what was sent at
    /// another for anything.
    #[inline(never)]
    pub(super) fn end_task(&mut self, news: TaskEvent, serial: Serial) {
        self.news = Some(news);
        self.settling.end();
        if let Some(since) = self.disturbed.take() {
            self.polling.keep_silent(since);
        }
        self.settings = self.settings.at(self.bus(), serial);
    }

    /// The settings have changed: at which bit rate the bus is to run. A task keeps the one it `works` at.
    pub(super) fn wanted(&mut self, engine: &Engine, works: bool, now: Instant) -> Option<Serial> {
        if !core::mem::take(&mut self.pending) {
            return None;
        }
        let serial = engine.timing().serial;
        let wanted = if works { serial } else { self.settings.timing.serial };
        if wanted != serial {
            self.polling.keep_silent(now);
        }
        Some(wanted)
    }

    /// The bus runs as it is set, at this bit rate: how its master and its line run then.
    #[inline(never)]
    pub(super) fn run(
        &mut self,
        engine: &Engine,
        serial: Serial,
        now: Instant,
        slots: &mut [Polled],
    ) -> (Timing, LineSettings) {
        if serial != engine.timing().serial {
            // Others may answer at another bit rate.
            self.meaning_changed(Nodes::ALL, now, now, slots);
        }
        let BusSettings { timing, line } = self.settings.at(self.bus(), serial);
        (timing, line)
    }

    /// An answer of the node at this address came too late.
    pub(super) fn came_late(&self, node: u8, slots: &mut [Polled]) {
        self.count(slots, node, |counters| &mut counters.late);
    }

    /// Counts something for all slots that read the node at `address`.
    fn count(&self, slots: &mut [Polled], address: u8, counter: impl Fn(&mut SlotCounters) -> &mut u16) {
        let node = Some((self.bus(), address));
        for Polled { slot, .. } in slots {
            if slot.config.source.node() == node {
                bump16(counter(&mut slot.counters));
            }
        }
    }
}
