//! The end of a bus that speaks its protocol: the master, and the task under way. What is the same for both protocols is in
//! `bus_task.rs` and `polling.rs`, which see this end as a [`dyn Endpoint`](Endpoint): so that code is in the image once.
//!
//! What comes out of an exchange is an [`Outcome`]: codes and a value, whatever the protocol's answer looks like.

use clino_bus::line::MAX_FRAME;
use clino_bus::{BusCounters, Event, ExchangeOutcome, Fault, Instant, Master, Protocol, Serial, Timing};
use clino_codec::checks::Check;
use clino_commissioning::{RunnerAction, TaskProgress};
use heapless::Vec;

use super::poll::Poll;
use crate::schedule::Turn;
use crate::schedule::queue::Asked;
use crate::slot::{Identity, Sample, Slot};
use crate::task::{Claim, TaskEvent, Tasks};
use crate::trace::Verdict;
use crate::{Bus, SlotConfig, Status};

/// A protocol that is polled and has tasks.
pub(crate) trait Serve: Poll + Tasks {}

impl<P: Poll + Tasks> Serve for P {}

/// How an exchange ended.
pub(crate) struct Outcome {
    pub at: Instant,
    pub verdict: Verdict,
    pub what: Ending,
}

/// What the end of an exchange means.
pub(crate) enum Ending {
    /// It was the task's, which has been told.
    Task,
    /// The sensor has said what it is.
    Identity(Identity),
    /// The sensor has answered: a value, or what is wrong with it.
    Value(Result<Sample, Status>),
    /// No good answer, and what that makes of the slot's value.
    Fault(Fault<Check>, Status),
}

/// A frame for the line.
pub(crate) type Frame = Vec<u8, MAX_FRAME>;

/// A request for a slot has begun.
pub(crate) struct Begun {
    pub frame: Frame,
    /// Characters of its answer after the first.
    pub rest_characters: u32,
}

/// The next step of a task.
pub(crate) enum TaskStep {
    /// Nothing now.
    Idle,
    /// Send this frame.
    Send(Frame),
    /// Change to this bit rate.
    Serial(Serial),
    /// The task has ended; its event is where it was to be put.
    Done,
}

/// What differs between the protocols beside their messages.
pub(crate) struct Facts {
    pub bus: Bus,
    /// [`Poll::RESOLUTION`].
    pub resolution: u32,
    /// [`Poll::SETTLES`].
    pub settles: clino_bus::Duration,
}

/// The end of a bus, whatever it speaks.
pub(crate) trait Endpoint {
    fn facts(&self) -> &'static Facts;

    // The master.
    fn counters(&self) -> &BusCounters;
    fn clear_counters(&mut self);
    fn timing(&self) -> &Timing;
    fn set_timing(&mut self, timing: Timing);
    fn is_asking(&self) -> bool;
    fn poll_at(&self) -> Option<Instant>;
    fn take_late(&mut self) -> Option<u8>;
    /// Takes an event of the line. `config` is that of the slot that was asked; an event of the task goes to `news`.
    fn on(
        &mut self,
        event: Event,
        config: Option<&SlotConfig>,
        news: &mut Option<TaskEvent>,
    ) -> Option<Outcome>;
    /// Lets time pass; as [`Endpoint::on`].
    fn poll(
        &mut self,
        now: Instant,
        config: Option<&SlotConfig>,
        news: &mut Option<TaskEvent>,
    ) -> Option<Outcome>;

    // Slots.
    /// When the master can ask for the slot's value.
    fn ask_at(&self, slot: &Slot) -> Option<Instant>;
    /// Asks for it.
    fn ask(&mut self, slot: &Slot, retry: bool, now: Instant) -> Option<Begun>;
    /// A good reading ended at `at`: [`Poll::note`].
    fn note(&self, turn: &mut Turn, config: &SlotConfig, sample: &Sample, asked: &Asked, at: Instant)
    -> bool;

    // Frames.
    /// Address and command in a request.
    fn named(&self, frame: &[u8]) -> (u8, u8);
    /// Whether a request with this command may change what the node's angle means.
    fn alters(&self, command: u8) -> bool;

    // Tasks.
    /// What the task that was accepted works on; `None` while there is none.
    fn claim(&self) -> Option<Claim>;
    /// The task that was accepted is over.
    fn end_task(&mut self);
    /// The task begins, or says how it has ended at once.
    fn begin_task(&mut self) -> Result<(), TaskEvent>;
    /// Whether it has begun and not ended.
    fn has_begun(&self) -> bool;
    fn is_exclusive(&self) -> bool;
    fn task_at(&self) -> Option<Instant>;
    fn progress(&self) -> Option<TaskProgress>;
    /// Stops it at its next consistent point. Returns whether it had begun.
    fn cancel(&mut self) -> bool;
    /// Its next step; how it has ended goes to `news`.
    fn step(&mut self, now: Instant, news: &mut Option<TaskEvent>) -> TaskStep;
}

/// The end that speaks `P`.
pub(crate) struct ProtocolEnd<P: Serve> {
    master: Master<P>,
    /// The task that was accepted, until it has ended.
    task: Option<P::Task>,
    /// The same, once it has begun.
    work: Option<P::Work>,
}

impl<P: Serve> ProtocolEnd<P> {
    /// A master with nothing in hand, and no task. Inlined, for it is large.
    #[inline(always)]
    pub fn new(timing: Timing) -> Self {
        ProtocolEnd { master: Master::new(timing), task: None, work: None }
    }

    /// Takes a task, if there is none.
    pub fn accept(&mut self, task: &P::Task) {
        self.task = Some(*task);
    }

    #[inline(never)]
    fn outcome(
        &mut self,
        outcome: &ExchangeOutcome<P>,
        config: Option<&SlotConfig>,
        news: &mut Option<TaskEvent>,
    ) -> Outcome {
        let what = match (&mut self.work, &outcome.result) {
            (Some(work), _) if P::runner_ref(work).is_asking() => {
                *news = P::runner(work).settle(outcome);
                Ending::Task
            }
            (_, Ok(answer)) => match P::identity(answer) {
                Some(identity) => Ending::Identity(identity),
                // A slot that was set anew meanwhile has no use for it.
                None => Ending::Value(config.map_or(Err(Status::BadAnswer), |c| P::sample(answer, c))),
            },
            (_, Err(fault)) => Ending::Fault(fault.with_check(), status_of::<P>(fault)),
        };
        Outcome { at: outcome.at, verdict: Verdict::of(&outcome.result), what }
    }
}

impl<P: Serve> Endpoint for ProtocolEnd<P> {
    fn facts(&self) -> &'static Facts {
        const { &Facts { bus: P::BUS, resolution: P::RESOLUTION, settles: P::SETTLES } }
    }

    fn counters(&self) -> &BusCounters {
        self.master.counters()
    }

    fn clear_counters(&mut self) {
        self.master.clear_counters();
    }

    fn timing(&self) -> &Timing {
        self.master.timing()
    }

    fn set_timing(&mut self, timing: Timing) {
        self.master.set_timing(timing);
    }

    fn is_asking(&self) -> bool {
        self.master.is_asking()
    }

    fn poll_at(&self) -> Option<Instant> {
        self.master.poll_at()
    }

    fn take_late(&mut self) -> Option<u8> {
        self.master.take_late()
    }

    fn on(
        &mut self,
        event: Event,
        config: Option<&SlotConfig>,
        news: &mut Option<TaskEvent>,
    ) -> Option<Outcome> {
        let outcome = self.master.on(event)?;
        Some(self.outcome(&outcome, config, news))
    }

    fn poll(
        &mut self,
        now: Instant,
        config: Option<&SlotConfig>,
        news: &mut Option<TaskEvent>,
    ) -> Option<Outcome> {
        let outcome = self.master.poll(now)?;
        Some(self.outcome(&outcome, config, news))
    }

    fn ask_at(&self, slot: &Slot) -> Option<Instant> {
        let (address, request) = P::request(slot)?;
        self.master.ask_at(address, &request)
    }

    fn ask(&mut self, slot: &Slot, retry: bool, now: Instant) -> Option<Begun> {
        let (address, request) = P::request(slot)?;
        let frame = match retry {
            true => self.master.begin_retry(address, &request, now),
            false => self.master.begin(address, &request, now),
        };
        let frame = Vec::from_slice(frame.ok()?.as_ref()).ok()?;
        if slot.config.timeout.as_micros() > 0 {
            self.master.allow(slot.config.timeout);
        }
        let characters = P::size(&P::expected(address, &request)) as u32;
        Some(Begun { frame, rest_characters: characters.saturating_sub(1) })
    }

    fn note(
        &self,
        turn: &mut Turn,
        config: &SlotConfig,
        sample: &Sample,
        asked: &Asked,
        at: Instant,
    ) -> bool {
        P::note(turn, config, sample, asked, at)
    }

    fn named(&self, frame: &[u8]) -> (u8, u8) {
        P::named(frame)
    }

    fn alters(&self, command: u8) -> bool {
        P::alters(command)
    }

    fn claim(&self) -> Option<Claim> {
        self.task.as_ref().map(P::claim)
    }

    fn end_task(&mut self) {
        self.task = None;
    }

    fn begin_task(&mut self) -> Result<(), TaskEvent> {
        match &self.task {
            Some(task) => P::begin(task, self.master.timing().serial, &mut self.work),
            None => Ok(()),
        }
    }

    fn has_begun(&self) -> bool {
        self.work.is_some()
    }

    fn is_exclusive(&self) -> bool {
        self.work.as_ref().is_some_and(|work| P::runner_ref(work).is_exclusive())
    }

    fn task_at(&self) -> Option<Instant> {
        P::runner_ref(self.work.as_ref()?).poll_at()
    }

    fn progress(&self) -> Option<TaskProgress> {
        match &self.work {
            Some(work) => Some(P::runner_ref(work).progress()),
            None => self.task.map(|_| TaskProgress::default()),
        }
    }

    fn cancel(&mut self) -> bool {
        let Some(work) = &mut self.work else { return false };
        P::runner(work).cancel();
        true
    }

    fn step(&mut self, now: Instant, news: &mut Option<TaskEvent>) -> TaskStep {
        let Some(work) = &mut self.work else { return TaskStep::Idle };
        match P::runner(work).poll(&mut self.master, now) {
            RunnerAction::Idle => TaskStep::Idle,
            // The line would refuse a longer frame, too.
            RunnerAction::Send(frame) => {
                Vec::from_slice(frame.as_ref()).map_or(TaskStep::Idle, TaskStep::Send)
            }
            RunnerAction::Serial(serial) => TaskStep::Serial(serial),
            RunnerAction::Done(Ok(event)) => {
                (self.work, *news) = (None, Some(event));
                TaskStep::Done
            }
        }
    }
}

fn status_of<P: Poll>(fault: &Fault<<P as Protocol>::DecodeError>) -> Status {
    match fault {
        Fault::NoAnswer { .. } => Status::NoAnswer,
        Fault::Garbled { .. } => Status::BadAnswer,
        Fault::Bad(error) => P::refused(error),
        // Nothing here is collected.
        Fault::NotSent | Fault::LineBusy | Fault::Contention | Fault::Over { .. } => Status::NotSent,
    }
}
