//! Commissioning tasks: which there are, and how one runs while the bus goes on polling.
//!
//! One task at a time on each bus. It takes turns with the polling, one exchange each, except while it uses the line at
//! a bit rate of its own. What it finds and how it ends is [`TaskEvent`]; the task waits until its news has been fetched, so
//! that a slow reader loses none. What no other order may change until then is its claim (`task/claim.rs`).

mod claim;
mod follow;
pub mod isu;
mod reason;
pub mod t7;

use clino_bus::{ExchangeOutcome, Instant, Master, Protocol, Serial};
use clino_commissioning::{Commissionable, Operation, Runner, RunnerAction, TaskProgress};

pub(crate) use claim::Claim;
pub(crate) use follow::followed;
pub use reason::Reason;

/// An event of a task: what it has found, or how it has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TaskEvent {
    /// Of a task on the T7 bus.
    T7(t7::TaskEvent),
    /// Of a task on the ISU bus.
    Isu(isu::TaskEvent),
}

impl TaskEvent {
    /// Whether it is the last of its task.
    pub fn is_end(&self) -> bool {
        !matches!(self, TaskEvent::T7(t7::TaskEvent::Found(_)))
    }
}

/// The next step of a task: what its bus has to do.
pub(crate) enum TaskStep<P: Protocol> {
    /// Nothing now.
    Idle,
    /// Send this frame.
    Send(P::Frame),
    /// Change to this bit rate.
    Serial(Serial),
    /// The task has ended.
    Done(TaskEvent),
}

/// Runs one task, whatever its operation is.
pub(crate) trait TaskRunner<P: Protocol> {
    fn poll(&mut self, master: &mut Master<P>, now: Instant) -> TaskStep<P>;
    fn settle(&mut self, outcome: &ExchangeOutcome<P>) -> Option<TaskEvent>;
    fn poll_at(&self) -> Option<Instant>;
    fn is_asking(&self) -> bool;
    fn is_exclusive(&self) -> bool;
    fn progress(&self) -> TaskProgress;
    fn cancel(&mut self);
}

/// A protocol with tasks of its own.
pub(crate) trait Tasks: Commissionable {
    type Task: Copy;
    type Work;
    /// Begins a task on a line that runs like this, in its place; or says how it has ended at once.
    fn begin(task: &Self::Task, serial: Serial, place: &mut Option<Self::Work>) -> Result<(), TaskEvent>;
    /// What no other order may change until the task has ended.
    fn claim(task: &Self::Task) -> Claim;
    fn runner(work: &mut Self::Work) -> &mut dyn TaskRunner<Self>;
    fn runner_ref(work: &Self::Work) -> &dyn TaskRunner<Self>;
}

/// Makes a task in its place. Not inlined, for a task is large: so only the one that begins is ever on the stack.
#[inline(never)]
fn put<W, E>(place: &mut Option<W>, task: impl FnOnce() -> Result<W, E>) -> Result<(), E> {
    *place = Some(task()?);
    Ok(())
}

impl<P, O> TaskRunner<P> for Runner<O>
where
    P: Commissionable,
    O: Operation<Protocol = P>,
    O::Event: Into<TaskEvent>,
    O::Report: Into<TaskEvent>,
    O::Error: Into<TaskEvent>,
{
    fn poll(&mut self, master: &mut Master<P>, now: Instant) -> TaskStep<P> {
        match self.poll(master, now) {
            RunnerAction::Idle => TaskStep::Idle,
            RunnerAction::Send(frame) => TaskStep::Send(frame),
            RunnerAction::Serial(serial) => TaskStep::Serial(serial),
            RunnerAction::Done(Ok(report)) => TaskStep::Done(report.into()),
            RunnerAction::Done(Err(error)) => TaskStep::Done(error.into()),
        }
    }

    fn settle(&mut self, outcome: &ExchangeOutcome<P>) -> Option<TaskEvent> {
        self.settle(outcome).map(Into::into)
    }

    fn poll_at(&self) -> Option<Instant> {
        self.poll_at()
    }

    fn is_asking(&self) -> bool {
        self.is_asking()
    }

    fn is_exclusive(&self) -> bool {
        self.is_exclusive()
    }

    fn progress(&self) -> TaskProgress {
        self.progress()
    }

    fn cancel(&mut self) {
        self.cancel();
    }
}
