//! What uses a bus next: the polling of slots, or a commissioning task.
//!
//! They take turns, one exchange each, so that neither waits for more than one exchange of the other. While a
//! task runs the line at a bit rate of its own, nothing is polled.
//!
//! *Orders have an order.* What was acknowledged is carried out in the order in which it was acknowledged:
//!
//! - A change of settings comes into force between two exchanges, before the next one begins.
//! - After a change of the bit rate the bus keeps silent until every node recognises requests again
//!   ([`Poll::SILENCE`]).
//! - A task begins after both. Until it has ended, the bit rate is the task's: a change of it is refused. All other
//!   settings change between two exchanges of the task.
//! - A task that has changed the bit rate for good leaves that rate, and nothing else, in the settings.

use clino_bus::{Event, ExchangeOutcome, Instant, Master, Serial, Timing, earliest};
use clino_commissioning::{RunnerAction, TaskProgress};

use crate::bits::Bits;
use crate::counters::{SlotCounters, bump16};
use crate::event::{Action, Requester};
use crate::features::COMMISSIONING;
use crate::schedule::Polled;
use crate::schedule::outage::BusHealth;
use crate::schedule::queue::Asked;
use crate::schedule::settling::{Nodes, Settling, readers};
use crate::settings::{BusChange, BusSettings};
use crate::task::{Claim, TaskEvent, Tasks};
use crate::trace::{Entry, Purpose, Verdict};
use crate::{Bus, SlotConfig};

mod polling;

use polling::{Poll, Polling, Said};

/// A task changes the bit rate once and asks; more often in a row is a mistake of the task.
const RATES_AT_ONCE: usize = 4;

/// A protocol that is polled and has tasks.
pub(crate) trait Serve: Poll + Tasks {}

impl<P: Poll + Tasks> Serve for P {}

/// An exchange has ended.
pub(crate) struct Ended {
    /// Its entry in the trace.
    pub entry: Entry,
    /// The slot whose value it has changed.
    pub slot: Option<usize>,
}

/// A reading that went well.
struct Answered {
    asked: Asked,
    said: Said,
    at: Instant,
    entry: Entry,
}

pub(crate) struct BusTask<P: Serve> {
    master: Master<P>,
    polling: Polling<P>,
    /// The exchange under way.
    begun: Entry,
    /// A reading that went well. What it says can wait until the next request is on its way.
    answer: Option<Answered>,
    /// The task that was accepted, until it has ended.
    task: Option<P::Task>,
    /// The same, once it has begun.
    work: Option<P::Work>,
    /// It is to stop before it has begun.
    cancelled: bool,
    /// The requester of the task, or of the last one.
    requester: Requester,
    /// Not fetched yet; the next task waits until it is.
    news: Option<TaskEvent>,
    /// How the bus is to run.
    settings: BusSettings,
    /// The line does not run like this yet.
    pending: bool,
    /// The task has changed the bit rate: what went over the line since ended then.
    disturbed: Option<Instant>,
    task_is_next: bool,
    settling: Settling,
    /// Slots that were restarted since they were last taken.
    restarted: Bits,
}

impl<P: Serve> BusTask<P> {
    /// A bus that reads nothing.
    #[inline(always)]
    pub fn idle(timing: Timing) -> Self {
        BusTask {
            master: Master::new(timing),
            polling: Polling::idle(),
            begun: Entry::begun(Instant::ZERO, P::BUS, (0, 0), Purpose::Task),
            answer: None,
            task: None,
            work: None,
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

    /// The bus runs like this from the beginning.
    pub fn set_up(&mut self, settings: &BusSettings) {
        self.master.set_timing(settings.timing);
        self.settings = *settings;
        // The port runs without delays and echo until it gets other settings.
        self.pending = settings.line != settings.timing.line();
    }

    pub fn master(&self) -> &Master<P> {
        &self.master
    }

    /// These settings are to change. Returns whether they do: the bit rate may be a task's.
    pub fn change(&mut self, change: &BusChange) -> bool {
        let settings = self.settings.with(P::BUS, change);
        if let Some(task) = &self.task
            && change.baud.is_some()
            && (settings.timing.serial != self.settings.timing.serial || P::claim(task) == Claim::BitRate)
        {
            return false;
        }
        if settings != self.settings {
            self.settings = settings;
            self.pending = true;
        }
        true
    }

    /// Accepts a task, unless there is one.
    pub fn accept(&mut self, task: &P::Task, requester: Requester) -> bool {
        let idle = COMMISSIONING && self.task.is_none() && self.news.is_none();
        if idle {
            (self.task, self.requester, self.cancelled) = (Some(*task), requester, false);
        }
        idle
    }

    /// What the task that was accepted works on.
    pub fn claim(&self) -> Claim {
        self.task.as_ref().map_or(Claim::Nothing, P::claim)
    }

    /// The claim of a task that has just ended, and how it has ended; once.
    pub fn ended(&mut self) -> Option<(Claim, TaskEvent)> {
        let news = self.news.as_ref().filter(|news| COMMISSIONING && news.is_end())?;
        self.task.take().map(|task| (P::claim(&task), *news))
    }

    /// The task shall stop at its next consistent point.
    pub fn cancel(&mut self) {
        match &mut self.work {
            Some(work) => P::runner(work).cancel(),
            None => self.cancelled = true,
        }
    }

    /// How far the task is.
    pub fn progress(&self) -> Option<TaskProgress> {
        match &self.work {
            Some(work) => Some(P::runner_ref(work).progress()),
            None => self.task.map(|_| TaskProgress::default()),
        }
    }

    /// The event of the task, if this requester has ordered it.
    pub fn task_event(&mut self, requester: Requester) -> Option<TaskEvent> {
        self.news.take_if(|_| COMMISSIONING && self.requester == requester)
    }

    /// Whether the task has an event for this requester.
    pub fn has_task_event(&self, requester: Requester) -> bool {
        COMMISSIONING && self.news.is_some() && self.requester == requester
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
    pub fn meaning_changed(&mut self, nodes: Nodes, until: Instant, now: Instant, slots: &mut [Polled]) {
        self.settling.add(nodes, until, now);
        let readers = readers(slots, P::BUS, nodes);
        for index in readers.iter() {
            if let Some(polled) = slots.get_mut(index) {
                polled.restart();
            }
        }
        self.restarted = self.restarted.or(readers);
    }

    /// Whether the answer of the node at this address to a request of `asked` is not used yet.
    pub fn is_settling(&self, address: u8, asked: Instant) -> bool {
        self.settling.holds(Nodes::at(P::BUS, address), asked)
    }

    /// The slots that were restarted since this was last called.
    pub fn take_restarted(&mut self) -> Bits {
        core::mem::replace(&mut self.restarted, Bits::EMPTY)
    }

    /// Sets what was counted to zero.
    pub fn clear_counters(&mut self) {
        self.master.clear_counters();
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

    /// Takes an event of the line. Returns the exchange that it has ended.
    pub fn on(&mut self, event: Event, slots: &mut [Polled]) -> Option<Ended> {
        let outcome = self.master.on(event);
        if let Event::Released { at } = event {
            self.polling.look_ahead(at, slots);
        }
        self.polling.look_again();
        self.settle(outcome.as_ref()?, slots)
    }

    /// Lets time pass. Returns the exchange that is over.
    #[inline(never)]
    pub fn poll(
        &mut self,
        now: Instant,
        slots: &mut [Polled],
        mut port: impl FnMut(Action<'_>),
    ) -> Option<Ended> {
        let over = self.end(now, slots);
        if self.work.is_none() {
            self.settling.end();
        }
        if !self.master.is_asking() {
            self.begin_next(now, slots, &mut port);
        }
        let answered = self.take(slots);
        if let Some(node) = self.master.take_late() {
            count(slots, P::BUS, node, |counters| &mut counters.late);
        }
        answered.or(over)
    }

    /// The exchange under way may be over.
    #[inline(never)]
    fn end(&mut self, now: Instant, slots: &mut [Polled]) -> Option<Ended> {
        let outcome = self.master.poll(now);
        self.settle(outcome.as_ref()?, slots)
    }

    /// Takes the content of a reading that went well.
    #[inline(never)]
    fn take(&mut self, slots: &mut [Polled]) -> Option<Ended> {
        let Answered { asked, said, at, entry } = self.answer.take()?;
        let node = slots.get(asked.slot).and_then(|polled| polled.slot.config.source.node());
        let address = node.map_or(0, |(_, address)| address);
        let serial = said.as_ref().ok().and_then(|sample| sample.as_ref()?.serial);
        if let Some((polled, serial)) = slots.get_mut(asked.slot).zip(serial)
            && polled.slot.is_replaced_by(serial)
        {
            self.meaning_changed(Nodes::at(P::BUS, address), Instant::ZERO, at, slots);
        }
        let used = !self.is_settling(address, asked.since);
        Some(Ended { entry, slot: self.polling.take(&self.master, &asked, said, used, at, slots) })
    }

    /// Begins the next exchange, if one is due: of the polling or of the task, whichever has its turn.
    #[inline(never)]
    fn begin_next(&mut self, now: Instant, slots: &mut [Polled], port: &mut impl FnMut(Action<'_>)) {
        if core::mem::take(&mut self.pending) {
            let serial = self.master.timing().serial;
            let wanted = if self.work.is_some() { serial } else { self.settings.timing.serial };
            if wanted != serial {
                self.polling.keep_silent(now);
            }
            self.run(wanted, now, slots, port);
        }
        self.begin_task(now);
        let task_first = self.task_is_next;
        for task in [task_first, !task_first] {
            let begun = match task {
                true => self.advance(now, slots, port),
                false if self.is_exclusive() => false,
                false => self.ask(now, slots, port),
            };
            if begun {
                self.task_is_next = !task;
                return;
            }
        }
    }

    /// Begins the task that was accepted, once every node recognises requests.
    #[inline(never)]
    fn begin_task(&mut self, now: Instant) {
        let (true, Some(task), None, None) = (COMMISSIONING, &self.task, &self.work, &self.news) else {
            return;
        };
        if now < self.polling.silent_until() && !self.cancelled {
            return;
        }
        if let Err(news) = P::begin(task, self.master.timing().serial, &mut self.work) {
            self.news = Some(news);
        }
        // One that is to stop sends nothing.
        if self.cancelled {
            self.cancel();
        }
    }

    /// Asks for the slot that is due, if one is; says whether it has.
    #[inline(never)]
    fn ask(&mut self, now: Instant, slots: &mut [Polled], port: &mut impl FnMut(Action<'_>)) -> bool {
        let Some((frame, purpose)) = self.polling.next(&mut self.master, now, slots) else { return false };
        self.send(frame.as_ref(), purpose, now, port);
        true
    }

    fn send(&mut self, frame: &[u8], purpose: Purpose, now: Instant, port: &mut impl FnMut(Action<'_>)) {
        port(Action::Send(frame));
        self.begun = Entry::begun(now, P::BUS, P::named(frame), purpose);
    }

    /// When [`BusTask::poll`] has something to do, if ever.
    pub fn poll_at(&self) -> Option<Instant> {
        let master = self.master.poll_at();
        if self.master.is_asking() {
            return master;
        }
        let task = match (&self.work, &self.task, &self.news) {
            (Some(work), _, None) => P::runner_ref(work).poll_at(),
            (None, Some(_), None) if self.cancelled => Some(Instant::ZERO),
            (None, Some(_), None) => Some(self.polling.silent_until()),
            _ => None,
        };
        let polling = if self.is_exclusive() { None } else { self.polling.poll_at() };
        let pending = self.pending.then_some(Instant::ZERO);
        earliest(earliest(master, task), earliest(polling, pending))
    }

    fn is_exclusive(&self) -> bool {
        self.work.as_ref().is_some_and(|work| P::runner_ref(work).is_exclusive())
    }

    #[inline(never)]
    fn settle(&mut self, outcome: &ExchangeOutcome<P>, slots: &mut [Polled]) -> Option<Ended> {
        let entry = self.begun.ended(outcome.at, Verdict::of(&outcome.result));
        let slot = match (&mut self.work, &outcome.result) {
            (Some(work), result) if P::runner_ref(work).is_asking() => {
                if result.is_ok() {
                    self.polling.heard(&self.master, outcome.at, slots);
                }
                self.disturbed = self.disturbed.map(|_| outcome.at);
                self.news = P::runner(work).settle(outcome);
                self.settling.sent(outcome.at + P::SETTLES);
                None
            }
            (_, Ok(answer)) => {
                let (asked, said) = self.polling.end(&self.master, answer, outcome.at, slots)?;
                self.answer = Some(Answered { asked, said, at: outcome.at, entry });
                return None;
            }
            (_, Err(fault)) => self.polling.fail(&self.master, fault, outcome.at, slots),
        };
        Some(Ended { entry, slot })
    }

    /// Runs the task's next steps; returns whether it has begun an exchange.
    #[inline(never)]
    fn advance(&mut self, now: Instant, slots: &mut [Polled], port: &mut impl FnMut(Action<'_>)) -> bool {
        if self.news.is_some() {
            return false;
        }
        let writes = self.master.counters().writes;
        for _ in 0..RATES_AT_ONCE {
            let Some(work) = &mut self.work else { return false };
            match P::runner(work).poll(&mut self.master, now) {
                RunnerAction::Idle => return false,
                RunnerAction::Send(ref frame) => {
                    if self.master.counters().writes != writes {
                        let (address, _) = P::named(frame.as_ref());
                        count(slots, P::BUS, address, |counters| &mut counters.writes);
                    }
                    let (address, command) = P::named(frame.as_ref());
                    if P::alters(command) {
                        self.alter(address, now, slots);
                    }
                    self.send(frame.as_ref(), Purpose::Task, now, port);
                    return true;
                }
                RunnerAction::Serial(serial) => {
                    self.disturbed = Some(now);
                    self.run(serial, now, slots, port);
                }
                RunnerAction::Done(Ok(news)) => {
                    self.work = None;
                    self.news = Some(news);
                    self.stay();
                    return false;
                }
            }
        }
        false
    }

    /// The task's next request may change the node at this address.
    #[inline(never)]
    fn alter(&mut self, address: u8, now: Instant, slots: &mut [Polled]) {
        let destination = match self.claim() {
            Claim::Addresses(bus, [_, to]) => Nodes::at(bus, to),
            _ => Nodes::NONE,
        };
        let nodes = Nodes::at(P::BUS, address).and(destination);
        self.settling.begin(nodes, now);
        self.meaning_changed(nodes, now, now, slots);
    }

    /// A task has ended: the bit rate stays as it has left it. Nodes at this rate may have taken what was sent at
    /// another for anything.
    fn stay(&mut self) {
        if let Some(since) = self.disturbed.take() {
            self.polling.keep_silent(since);
        }
        self.settings = self.settings.at(P::BUS, self.master.timing().serial);
    }

    /// The bus runs as it is set, at this bit rate.
    #[inline(never)]
    fn run(&mut self, serial: Serial, now: Instant, slots: &mut [Polled], port: &mut impl FnMut(Action<'_>)) {
        if serial != self.master.timing().serial {
            // Others may answer at another bit rate.
            self.meaning_changed(Nodes::ALL, now, now, slots);
        }
        let BusSettings { timing, line } = self.settings.at(P::BUS, serial);
        self.master.set_timing(timing);
        port(Action::Run(timing, line));
    }
}

/// Counts something for all slots that read the node at `address`.
fn count(slots: &mut [Polled], bus: Bus, address: u8, counter: impl Fn(&mut SlotCounters) -> &mut u16) {
    for Polled { slot, .. } in slots {
        if slot.config.source.node() == Some((bus, address)) {
            bump16(counter(&mut slot.counters));
        }
    }
}
