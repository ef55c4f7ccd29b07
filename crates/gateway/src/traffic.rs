//! Who has a bus next: the polling of slots, or a commissioning task.
//!
//! They take turns, one exchange each, so that neither waits for more than one exchange of the other. A task that has
//! the line at a bit rate of its own has it alone. A change of settings waits for the end of both.

use clino_bus::{Event, Master, Micros, Outcome, Serial, Timing, earliest, line};
use clino_commissioning::{Commissionable, Progress};

use crate::Bus;
use crate::Status;
use crate::agenda::Asked;
use crate::bits::Bits;
use crate::counters::bump16;
use crate::gateway::{Action, Asker};
use crate::meaning::{Nodes, Settling, readers};
use crate::outage::BusHealth;
use crate::polling::{Poll, Polling};
use crate::settings::BusSettings;
use crate::slot::{Sample, Slot};
use crate::task::{Lead, Led, News};
use crate::trace::{Entry, Purpose, Verdict};

/// A task changes the bit rate once and asks; more often in a row is a mistake of the task.
const RATES_AT_ONCE: usize = 4;

/// A protocol with tasks of its own.
pub(crate) trait Serve: Poll + Commissionable {
    type Work;
    fn led(work: &mut Self::Work) -> &mut dyn Led<Self>;
    fn led_ref(work: &Self::Work) -> &dyn Led<Self>;
    /// The usual waits at a bit rate.
    fn timing(serial: Serial) -> Timing;
}

/// An exchange has ended.
pub(crate) struct Ended {
    /// What is told of it.
    pub entry: Entry,
    /// The slot whose value it has changed.
    pub slot: Option<usize>,
}

/// A reading that went well.
struct Answered {
    asked: Asked,
    result: Result<Sample, Status>,
    at: Micros,
    entry: Entry,
}

pub(crate) struct Traffic<P: Serve> {
    master: Master<P>,
    polling: Polling<P>,
    /// The exchange in hand.
    begun: Entry,
    /// A reading that went well. What it says can wait until the next request is on its way.
    answer: Option<Answered>,
    work: Option<P::Work>,
    /// Whose task it is, or was.
    asker: Asker,
    /// Not fetched yet; the task waits until it is.
    news: Option<News>,
    /// How the bus is to run as soon as nothing is under way.
    pending: Option<BusSettings>,
    line: line::Settings,
    /// How it ran before the task.
    home: Timing,
    task_is_next: bool,
    settling: Settling,
    /// Where the task moves its node to.
    destination: Option<u8>,
    /// Slots that were restarted since they were last taken.
    restarted: Bits,
}

impl<P: Serve> Traffic<P> {
    /// A bus that reads nothing.
    #[inline(always)]
    pub fn idle(timing: Timing) -> Self {
        Traffic {
            master: Master::new(timing),
            polling: Polling::idle(),
            begun: Entry::begun(Micros::ZERO, P::BUS, (0, 0), Purpose::Task),
            answer: None,
            work: None,
            asker: Asker::Console,
            news: None,
            pending: None,
            line: timing.line(),
            home: timing,
            task_is_next: false,
            settling: Settling::default(),
            destination: None,
            restarted: Bits::EMPTY,
        }
    }

    /// The bus runs like this from the beginning.
    pub fn set_up(&mut self, settings: &BusSettings) {
        let timing = settings.timing;
        self.master.set_timing(timing);
        (self.line, self.home) = (timing.line(), timing);
        // The port runs without delays and echo until it is told otherwise.
        self.pending = Some(*settings).filter(|settings| settings.line != timing.line());
    }

    pub fn master(&self) -> &Master<P> {
        &self.master
    }

    /// How the line is set.
    pub fn line(&self) -> &line::Settings {
        &self.line
    }

    /// The bus is to run like this.
    pub fn set(&mut self, timing: Timing, line: line::Settings) {
        self.pending = Some(BusSettings { timing, line });
    }

    /// Has a task begun in its place, unless there is one. It may move its node to `destination`.
    pub fn begin<E>(
        &mut self,
        begin: impl FnOnce(&mut Option<P::Work>) -> Result<(), E>,
        destination: Option<u8>,
        asker: Asker,
    ) -> Result<bool, E> {
        let idle = self.work.is_none() && self.news.is_none();
        if idle {
            begin(&mut self.work)?;
            self.home = *self.master.timing();
            (self.asker, self.destination) = (asker, destination);
        }
        Ok(idle)
    }

    /// The task shall stop at its next consistent point.
    pub fn cancel(&mut self) {
        if let Some(work) = &mut self.work {
            P::led(work).cancel();
        }
    }

    /// How far the task is.
    pub fn progress(&self) -> Option<Progress> {
        self.work.as_ref().map(|work| P::led_ref(work).progress())
    }

    /// What the task has to say, if it is this asker's.
    pub fn news(&mut self, asker: Asker) -> Option<News> {
        self.news.take_if(|_| self.asker == asker)
    }

    /// Whether the task has something to say to this asker.
    pub fn has_news(&self, asker: Asker) -> bool {
        self.news.is_some() && self.asker == asker
    }

    /// How the bus is set, or will be as soon as nothing is under way.
    pub fn settings(&self) -> BusSettings {
        let timing = if self.work.is_some() { self.home } else { *self.master.timing() };
        let line = line::Settings { serial: timing.serial, guard: timing.guard, ..self.line };
        self.pending.unwrap_or(BusSettings { timing, line })
    }

    /// The numbers of these nodes mean something else from now on, by `until` at the latest: what was kept of them is
    /// forgotten, and what is asked before that is not used.
    #[inline(never)]
    pub fn meaning_changed(&mut self, nodes: Nodes, until: Micros, now: Micros, slots: &mut [Slot]) {
        self.settling.add(nodes, until, now);
        let readers = readers(slots, P::BUS, nodes);
        for index in readers.iter() {
            if let Some(slot) = slots.get_mut(index) {
                slot.restart();
            }
        }
        self.restarted = self.restarted.or(readers);
    }

    /// Whether what the node at this address says to a request of `asked` is not used yet.
    pub fn is_settling(&self, address: u8, asked: Micros) -> bool {
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

    /// The slot means something else now: what is still to come for it is nobody's.
    pub fn forget(&mut self, index: usize, slot: &Slot) {
        self.answer.take_if(|answer| answer.asked.slot == index);
        self.polling.forget(index, slot);
    }

    /// Takes an event of the line. Returns the exchange that it has ended.
    pub fn on(&mut self, event: Event, slots: &mut [Slot]) -> Option<Ended> {
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
        now: Micros,
        slots: &mut [Slot],
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
            count(slots, P::BUS, node, |slot| &mut slot.counters.late);
        }
        answered.or(over)
    }

    /// The exchange in hand may be over.
    #[inline(never)]
    fn end(&mut self, now: Micros, slots: &mut [Slot]) -> Option<Ended> {
        let outcome = self.master.poll(now);
        self.settle(outcome.as_ref()?, slots)
    }

    /// Takes what a reading that went well has said.
    #[inline(never)]
    fn take(&mut self, slots: &mut [Slot]) -> Option<Ended> {
        let Answered { asked, result, at, entry } = self.answer.take()?;
        let node = slots.get(asked.slot).and_then(|slot| slot.config.source.node());
        let address = node.map_or(0, |(_, address)| address);
        let serial = result.as_ref().ok().and_then(|sample| sample.serial);
        if let Some((slot, serial)) = slots.get_mut(asked.slot).zip(serial)
            && slot.is_replaced_by(serial)
        {
            self.meaning_changed(Nodes::at(P::BUS, address), Micros::ZERO, at, slots);
        }
        let used = !self.is_settling(address, asked.since);
        Some(Ended { entry, slot: self.polling.take(&self.master, &asked, result, used, at, slots) })
    }

    /// Whoever's turn it is may begin an exchange.
    #[inline(never)]
    fn begin_next(&mut self, now: Micros, slots: &mut [Slot], port: &mut impl FnMut(Action<'_>)) {
        if self.work.is_none()
            && let Some(BusSettings { timing, line }) = self.pending.take()
        {
            if timing.serial != self.master.timing().serial {
                self.polling.rate_has_changed(slots);
            }
            self.line = line;
            self.run(timing, now, slots, port);
        }
        let task_first = self.task_is_next;
        for task in [task_first, !task_first] {
            let begun = match task {
                true => self.lead(now, slots, port),
                false if self.is_exclusive() => false,
                false => self.ask(now, slots, port),
            };
            if begun {
                self.task_is_next = !task;
                return;
            }
        }
    }

    /// Asks for the slot that is due, if one is; says whether it has.
    #[inline(never)]
    fn ask(&mut self, now: Micros, slots: &mut [Slot], port: &mut impl FnMut(Action<'_>)) -> bool {
        let Some((frame, purpose)) = self.polling.next(&mut self.master, now, slots) else { return false };
        self.send(frame.as_ref(), purpose, now, port);
        true
    }

    fn send(&mut self, frame: &[u8], purpose: Purpose, now: Micros, port: &mut impl FnMut(Action<'_>)) {
        port(Action::Send(frame));
        self.begun = Entry::begun(now, P::BUS, P::named(frame), purpose);
    }

    /// When [`Traffic::poll`] has something to do, if ever.
    pub fn poll_at(&self) -> Option<Micros> {
        let master = self.master.poll_at();
        if self.master.is_asking() {
            return master;
        }
        let task = match (&self.work, &self.news) {
            (Some(work), None) => P::led_ref(work).poll_at(),
            _ => None,
        };
        let polling = if self.is_exclusive() { None } else { self.polling.poll_at() };
        let pending = self.pending.filter(|_| self.work.is_none()).map(|_| Micros::ZERO);
        earliest(earliest(master, task), earliest(polling, pending))
    }

    fn is_exclusive(&self) -> bool {
        self.work.as_ref().is_some_and(|work| P::led_ref(work).is_exclusive())
    }

    #[inline(never)]
    fn settle(&mut self, outcome: &Outcome<P>, slots: &mut [Slot]) -> Option<Ended> {
        let entry = self.begun.ended(outcome.at, Verdict::of(&outcome.result));
        let slot = match (&mut self.work, &outcome.result) {
            (Some(work), result) if P::led_ref(work).is_asking() => {
                if result.is_ok() {
                    self.polling.heard(&self.master, outcome.at, slots);
                }
                self.news = P::led(work).settle(outcome);
                self.settling.sent(outcome.at + P::SETTLES);
                None
            }
            (_, Ok(answer)) => {
                let (asked, result) = self.polling.end(&self.master, answer, outcome.at, slots)?;
                self.answer = Some(Answered { asked, result, at: outcome.at, entry });
                return None;
            }
            (_, Err(fault)) => self.polling.fail(&self.master, fault, outcome.at, slots),
        };
        Some(Ended { entry, slot })
    }

    /// Leads the task on; says whether it has begun an exchange.
    #[inline(never)]
    fn lead(&mut self, now: Micros, slots: &mut [Slot], port: &mut impl FnMut(Action<'_>)) -> bool {
        if self.news.is_some() {
            return false;
        }
        let writes = self.master.counters().writes;
        for _ in 0..RATES_AT_ONCE {
            let Some(work) = &mut self.work else { return false };
            match P::led(work).poll(&mut self.master, now) {
                Lead::Idle => return false,
                Lead::Send(ref frame) => {
                    if self.master.counters().writes != writes {
                        let (address, _) = P::named(frame.as_ref());
                        count(slots, P::BUS, address, |slot| &mut slot.counters.writes);
                    }
                    let (address, command) = P::named(frame.as_ref());
                    if P::alters(command) {
                        self.alter(address, now, slots);
                    }
                    self.send(frame.as_ref(), Purpose::Task, now, port);
                    return true;
                }
                Lead::Serial(serial) if serial == self.home.serial => self.run(self.home, now, slots, port),
                Lead::Serial(serial) => self.run(P::timing(serial), now, slots, port),
                Lead::Done(news) => {
                    self.work = None;
                    self.news = Some(news);
                    return false;
                }
            }
        }
        false
    }

    /// The task's next request may change the node at this address.
    #[inline(never)]
    fn alter(&mut self, address: u8, now: Micros, slots: &mut [Slot]) {
        let destination = self.destination.map_or(Nodes::NONE, |to| Nodes::at(P::BUS, to));
        let nodes = Nodes::at(P::BUS, address).and(destination);
        self.settling.begin(nodes, now);
        self.meaning_changed(nodes, now, now, slots);
    }

    #[inline(never)]
    fn run(&mut self, timing: Timing, now: Micros, slots: &mut [Slot], port: &mut impl FnMut(Action<'_>)) {
        if timing.serial != self.master.timing().serial {
            // Others may answer at another bit rate.
            self.meaning_changed(Nodes::ALL, now, now, slots);
        }
        self.master.set_timing(timing);
        self.line = line::Settings { serial: timing.serial, guard: timing.guard, ..self.line };
        port(Action::Run(timing, self.line));
    }
}

/// Counts something for all slots that read the node at `address`.
fn count(slots: &mut [Slot], bus: Bus, address: u8, counter: impl Fn(&mut Slot) -> &mut u16) {
    for slot in slots.iter_mut().filter(|slot| slot.config.source.node() == Some((bus, address))) {
        bump16(counter(slot));
    }
}
