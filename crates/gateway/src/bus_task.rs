//! What uses a bus next: the polling of slots, or a commissioning task.
//!
//! They take turns, one exchange each, so that neither waits for more than one exchange of the other. While a
//! task runs the line at a bit rate of its own, nothing is polled.
//!
//! *Orders have an order.* What was acknowledged is carried out in the order in which it was acknowledged:
//!
//! - A change of settings comes into force between two exchanges, before the next one begins.
//! - After a change of the bit rate the bus keeps silent until every node recognises requests again
//!   ([`PollRules::silence`]).
//! - A task begins after both. Until it has ended, the bit rate is the task's: a change of it is refused. All other
//!   settings change between two exchanges of the task.
//! - A task that has changed the bit rate for good leaves that rate, and nothing else, in the settings.

use clino_bus::{Event, Fault, Instant, Master, Serial, Timing};
use clino_commissioning::{RunnerAction, TaskProgress};

use crate::Status;
use crate::bits::Bits;
use crate::event::{Action, Requester};
use crate::features::COMMISSIONING;
use crate::schedule::Polled;
use crate::settings::BusSettings;
use crate::task::Tasks;
use crate::trace::{Entry, Purpose};

mod polling;
mod traffic;

use polling::Poll;
#[cfg(doc)]
use polling::PollRules;
pub(crate) use traffic::Traffic;

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

/// What a step of a task has led to.
enum Advanced {
    /// Nothing that is to be sent.
    Not,
    /// An exchange has begun.
    Begun,
    /// The line is to run at this bit rate.
    Rate(Serial),
}

pub(crate) struct BusTask<P: Serve> {
    master: Master<P>,
    /// What is the same for all protocols.
    traffic: Traffic,
    /// The task that was accepted, until it begins.
    task: Option<P::Task>,
    /// The task once it has begun.
    work: Option<P::Work>,
    /// When [`BusTask::poll`] has something to do. Whatever may have changed that sets it to zero: this is found out once,
    /// and not anew with each character on each bus.
    due: Instant,
}

impl<P: Serve> BusTask<P> {
    /// A bus that reads nothing.
    #[inline(always)]
    pub fn idle(timing: Timing) -> Self {
        BusTask {
            master: Master::new(timing),
            traffic: Traffic::idle(&P::RULES, timing),
            task: None,
            work: None,
            due: Instant::ZERO,
        }
    }

    /// There may be something to do.
    fn look_again(&mut self) {
        self.due = Instant::ZERO;
    }

    /// The bus runs like this from the beginning.
    pub fn set_up(&mut self, settings: &BusSettings) {
        self.master.set_timing(settings.timing);
        self.traffic.set_up(settings);
        self.look_again();
    }

    pub fn master(&self) -> &Master<P> {
        &self.master
    }

    pub fn traffic(&self) -> &Traffic {
        &self.traffic
    }

    pub fn traffic_mut(&mut self) -> &mut Traffic {
        self.look_again();
        &mut self.traffic
    }

    /// The slots that were restarted since this was last called.
    pub fn take_restarted(&mut self) -> Bits {
        self.traffic.take_restarted()
    }

    /// Accepts a task, unless there is one.
    pub fn accept(&mut self, task: &P::Task, requester: Requester) -> bool {
        let accepted = self.traffic.accept(P::claim(task), requester);
        if accepted {
            self.task = Some(*task);
            self.look_again();
        }
        accepted
    }

    /// The task shall stop at its next consistent point.
    pub fn cancel(&mut self) {
        self.look_again();
        match &mut self.work {
            Some(work) => P::runner(work).cancel(),
            None => self.traffic.cancelled = true,
        }
    }

    /// How far the task is.
    pub fn progress(&self) -> Option<TaskProgress> {
        match &self.work {
            Some(work) => Some(P::runner_ref(work).progress()),
            None => self.traffic.has_task().then(TaskProgress::default),
        }
    }

    /// Sets what was counted to zero.
    pub fn clear_counters(&mut self) {
        self.master.clear_counters();
        self.traffic.clear_counters();
    }

    /// Takes an event of the line. Returns the exchange that it has ended.
    pub fn on(&mut self, event: Event, slots: &mut [Polled]) -> Option<Ended> {
        let over = self.master.observe(event).is_some();
        if let Event::Released { at } = event {
            self.traffic.polling.look_ahead(at, slots);
        }
        self.traffic.polling.look_again();
        // Within an answer, there is nothing to do before its deadline, which this event has moved.
        self.due = match self.master.poll_at() {
            Some(deadline) if !over && self.master.is_asking() => deadline,
            _ => Instant::ZERO,
        };
        if over { self.settle(slots) } else { None }
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
        if !self.master.is_asking() {
            self.begin_next(now, slots, &mut port);
        }
        let answered = self.traffic.take(self.master.engine(), slots);
        if let Some(node) = self.master.take_late() {
            self.traffic.came_late(node, slots);
        }
        self.due = self.next_due();
        answered.or(over)
    }

    /// The exchange under way may be over.
    #[inline(never)]
    fn end(&mut self, now: Instant, slots: &mut [Polled]) -> Option<Ended> {
        self.master.lapse(now)?;
        self.settle(slots)
    }

    /// Begins the next exchange, if one is due: of the polling or of the task, whichever has its turn.
    #[inline(never)]
    fn begin_next(&mut self, now: Instant, slots: &mut [Polled], port: &mut impl FnMut(Action<'_>)) {
        if let Some(serial) = self.traffic.wanted(self.master.engine(), self.work.is_some(), now) {
            self.run(serial, now, slots, port);
        }
        self.begin_task(now);
        let task_first = self.traffic.task_is_next;
        for task in [task_first, !task_first] {
            let begun = match task {
                true => self.advance(now, slots, port),
                false if self.is_exclusive() => false,
                false => self.ask(now, slots, port),
            };
            if begun {
                self.traffic.task_is_next = !task;
                return;
            }
        }
    }

    /// Begins the task that was accepted, once every node recognises requests.
    #[inline(never)]
    fn begin_task(&mut self, now: Instant) {
        let traffic = &mut self.traffic;
        let due = traffic.news.is_none() && (now >= traffic.polling.silent_until() || traffic.cancelled);
        let Some(task) = self.task.take_if(|_| COMMISSIONING && due) else { return };
        if let Err(news) = P::begin(&task, self.master.timing().serial, &mut self.work) {
            traffic.news = Some(news);
        }
        // One that is to stop sends nothing.
        if traffic.cancelled {
            self.cancel();
        }
    }

    /// Asks for the slot that is due, if one is; says whether it has.
    #[inline(never)]
    fn ask(&mut self, now: Instant, slots: &mut [Polled], port: &mut impl FnMut(Action<'_>)) -> bool {
        // On a bus full of characters nothing can be asked, and each of them would have all slots looked through.
        if now < self.master.engine().clear_at() {
            return false;
        }
        let Some((index, purpose)) = self.traffic.polling.next(self.master.engine(), now, slots) else {
            return false;
        };
        let Some(polled) = slots.get_mut(index) else { return false };
        let Some((address, request)) = P::request(&polled.slot) else { return false };
        let frame = match purpose {
            Purpose::Retry => self.master.begin_retry(address, &request, now),
            _ => self.master.begin(address, &request, now),
        };
        let Ok(frame) = frame else { return false };
        if polled.slot.config.timeout.as_micros() > 0 {
            self.master.allow(polled.slot.config.timeout);
        }
        self.traffic.polling.begin(self.master.engine(), index, purpose, now, polled);
        port(Action::Send(frame.as_ref()));
        self.traffic.begin(self.master.engine(), purpose, now);
        true
    }

    /// When [`BusTask::poll`] has something to do; [`Instant::NEVER`] before the next order or event.
    pub fn due(&self) -> Instant {
        self.due
    }

    fn next_due(&self) -> Instant {
        let master = self.master.poll_at().unwrap_or(Instant::NEVER);
        if self.master.is_asking() {
            return master;
        }
        let traffic = &self.traffic;
        if traffic.pending {
            return Instant::ZERO;
        }
        let task = match (&self.work, &self.task, &traffic.news) {
            (Some(work), _, None) => P::runner_ref(work).poll_at().unwrap_or(Instant::NEVER),
            (None, Some(_), None) if traffic.cancelled => Instant::ZERO,
            (None, Some(_), None) => traffic.polling.silent_until(),
            _ => Instant::NEVER,
        };
        let polling = match traffic.polling.poll_at() {
            Some(at) if !self.is_exclusive() => at.max(self.master.engine().clear_at()),
            _ => Instant::NEVER,
        };
        master.min(task).min(polling)
    }

    fn is_exclusive(&self) -> bool {
        self.work.as_ref().is_some_and(|work| P::runner_ref(work).is_exclusive())
    }

    #[inline(never)]
    fn settle(&mut self, slots: &mut [Polled]) -> Option<Ended> {
        let (engine, outcome) = (self.master.engine(), self.master.outcome()?);
        let at = outcome.at;
        if let Some(runner) = self.work.as_mut().map(P::runner).filter(|runner| runner.is_asking()) {
            let fault = outcome.result.as_ref().err().map(Fault::by_check);
            let ended = self.traffic.task_settled(engine, fault.as_ref(), at, slots);
            self.traffic.news = runner.settle(outcome);
            return Some(ended);
        }
        match &outcome.result {
            Ok(answer) => {
                let asked = self.traffic.answered(engine, at, slots)?;
                let content = P::read(answer, &slots.get(asked.slot)?.slot.config);
                self.traffic.keep(asked, content, at, slots);
                None
            }
            Err(fault) => {
                let status = match fault {
                    Fault::NoAnswer { .. } => Status::NoAnswer,
                    Fault::Garbled { .. } => Status::BadAnswer,
                    Fault::Bad(error) => P::refused(error),
                    // Nothing here is collected.
                    Fault::NotSent | Fault::LineBusy | Fault::Contention | Fault::Over { .. } => {
                        Status::NotSent
                    }
                };
                Some(self.traffic.failed(engine, &fault.by_check(), status, at, slots))
            }
        }
    }

    /// Runs the task's next steps; returns whether it has begun an exchange.
    fn advance(&mut self, now: Instant, slots: &mut [Polled], port: &mut impl FnMut(Action<'_>)) -> bool {
        if self.traffic.news.is_some() {
            return false;
        }
        for _ in 0..RATES_AT_ONCE {
            match self.step(now, slots, port) {
                Advanced::Begun => return true,
                Advanced::Not => return false,
                Advanced::Rate(serial) => {
                    self.traffic.disturb(now);
                    self.run(serial, now, slots, port);
                }
            }
        }
        false
    }

    /// Runs the task's next step. A function of its own: the stack of its request is free again when the bit rate changes.
    #[inline(never)]
    fn step(&mut self, now: Instant, slots: &mut [Polled], port: &mut impl FnMut(Action<'_>)) -> Advanced {
        let writes = self.master.counters().writes;
        let Some(work) = &mut self.work else { return Advanced::Not };
        match P::runner(work).poll(&mut self.master, now) {
            RunnerAction::Idle => Advanced::Not,
            RunnerAction::Send(ref frame) => {
                let engine = self.master.engine();
                let wrote = engine.counters().writes != writes;
                let alters = P::alters(engine.expected().command);
                self.traffic.begin_for_task(engine, (wrote, alters), now, slots);
                port(Action::Send(frame.as_ref()));
                Advanced::Begun
            }
            RunnerAction::Serial(serial) => Advanced::Rate(serial),
            RunnerAction::Done(Ok(news)) => {
                self.work = None;
                self.traffic.end_task(news, self.master.timing().serial);
                Advanced::Not
            }
        }
    }

    /// The bus runs as it is set, at this bit rate.
    #[inline(never)]
    fn run(&mut self, serial: Serial, now: Instant, slots: &mut [Polled], port: &mut impl FnMut(Action<'_>)) {
        let (timing, line) = self.traffic.run(self.master.engine(), serial, now, slots);
        self.master.set_timing(timing);
        port(Action::Run(timing, line));
    }
}
