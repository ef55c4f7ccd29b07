//! Who has a bus next: the polling of slots, or a commissioning task.
//!
//! They take turns, one exchange each, so that neither waits for more than one exchange of the other. A task that has
//! the line at a bit rate of its own has it alone. A change of settings waits for the end of both.

use clino_bus::{Event, Master, Micros, Outcome, Serial, Timing, earliest, line};
use clino_commissioning::{Commissionable, Progress};

use crate::Bus;
use crate::Status;
use crate::agenda::Asked;
use crate::counters::bump16;
use crate::gateway::{Action, Asker};
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

    /// Begins a task, unless there is one.
    pub fn begin(&mut self, work: P::Work, asker: Asker) -> bool {
        let idle = self.work.is_none() && self.news.is_none();
        if idle {
            self.home = *self.master.timing();
            self.work = Some(work);
            self.asker = asker;
        }
        idle
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
        self.settle(outcome, slots)
    }

    /// Lets time pass. Returns the exchange that is over.
    pub fn poll(
        &mut self,
        now: Micros,
        slots: &mut [Slot],
        mut port: impl FnMut(Action<'_>),
    ) -> Option<Ended> {
        let outcome = self.master.poll(now);
        let over = self.settle(outcome, slots);
        if !self.master.is_asking() {
            self.begin_next(now, slots, &mut port);
        }
        let answered = self.answer.take().map(|answer| Ended {
            entry: answer.entry,
            slot: self.polling.take(&self.master, &answer.asked, answer.result, answer.at, slots),
        });
        if let Some(node) = self.master.take_late() {
            count(slots, P::BUS, node, |slot| &mut slot.counters.late);
        }
        answered.or(over)
    }

    /// Whoever's turn it is may begin an exchange.
    fn begin_next(&mut self, now: Micros, slots: &mut [Slot], port: &mut impl FnMut(Action<'_>)) {
        if self.work.is_none()
            && let Some(BusSettings { timing, line }) = self.pending.take()
        {
            if timing.serial != self.master.timing().serial {
                self.polling.rate_has_changed(slots);
            }
            self.line = line;
            self.run(timing, port);
        }
        let task_first = self.task_is_next;
        for task in [task_first, !task_first] {
            let begun = match task {
                true => self.lead(now, slots, port).map(|frame| (frame, Purpose::Task)),
                false if self.is_exclusive() => None,
                false => self.polling.next(&mut self.master, now, slots),
            };
            if let Some((frame, purpose)) = begun {
                self.task_is_next = !task;
                port(Action::Send(frame.as_ref()));
                self.begun = Entry::begun(now, P::BUS, P::named(frame.as_ref()), purpose);
                return;
            }
        }
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

    fn settle(&mut self, outcome: Option<Outcome<P>>, slots: &mut [Slot]) -> Option<Ended> {
        let outcome = outcome?;
        let entry = self.begun.ended(outcome.at, Verdict::of(&outcome.result));
        let slot = match (&mut self.work, &outcome.result) {
            (Some(work), result) if P::led_ref(work).is_asking() => {
                if result.is_ok() {
                    self.polling.heard(&self.master, outcome.at, slots);
                }
                self.news = P::led(work).settle(outcome);
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

    /// Leads the task on: its next frame, if it has one.
    fn lead(
        &mut self,
        now: Micros,
        slots: &mut [Slot],
        port: &mut impl FnMut(Action<'_>),
    ) -> Option<P::Frame> {
        if self.news.is_some() {
            return None;
        }
        let writes = self.master.counters().writes;
        for _ in 0..RATES_AT_ONCE {
            match P::led(self.work.as_mut()?).poll(&mut self.master, now) {
                Lead::Idle => return None,
                Lead::Send(frame) => {
                    if self.master.counters().writes != writes {
                        let (address, _) = P::named(frame.as_ref());
                        count(slots, P::BUS, address, |slot| &mut slot.counters.writes);
                    }
                    return Some(frame);
                }
                Lead::Serial(serial) if serial == self.home.serial => self.run(self.home, port),
                Lead::Serial(serial) => self.run(P::timing(serial), port),
                Lead::Done(news) => {
                    self.work = None;
                    self.news = Some(news);
                    return None;
                }
            }
        }
        None
    }

    fn run(&mut self, timing: Timing, port: &mut impl FnMut(Action<'_>)) {
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
