//! Commissioning tasks: which there are, and how one runs while the bus goes on polling.
//!
//! One task at a time on each bus. It takes turns with the polling, one exchange each, except while it uses the line at
//! a bit rate of its own. What it finds and how it ends is [`TaskEvent`]; the task waits until its news has been fetched, so
//! that a slow reader loses none. What no other order may change until then is its claim (`task/claim.rs`).

mod claim;
mod follow;
pub mod isu;
#[cfg(not(feature = "commissioning"))]
mod none;
mod reason;
pub mod t7;

use core::convert::Infallible;

use clino_bus::{ExchangeOutcome, Instant, Serial};
use clino_commissioning::{Commissionable, Operation, Runner, StepOf, TaskProgress};

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

/// Runs one task, whatever its operation is: in the image once for each bus.
pub(crate) type TaskRunner<P> =
    Runner<dyn Operation<Protocol = P, Event = TaskEvent, Report = TaskEvent, Error = Infallible>>;

/// A protocol with tasks of its own.
pub(crate) trait Tasks: Commissionable {
    type Task: Copy;
    type Work;
    /// Begins a task on a line that runs like this, in its place; or says how it has ended at once.
    fn begin(task: &Self::Task, serial: Serial, place: &mut Option<Self::Work>) -> Result<(), TaskEvent>;
    /// What no other order may change until the task has ended.
    fn claim(task: &Self::Task) -> Claim;
    fn runner(work: &mut Self::Work) -> &mut TaskRunner<Self>;
    fn runner_ref(work: &Self::Work) -> &TaskRunner<Self>;
}

/// Begins an operation in its place. A function for each operation: put together from one that chooses, they would all be on
/// the stack, field by field.
#[inline(never)]
pub(crate) fn put<W, E>(place: &mut Option<W>, make: impl FnOnce() -> Result<W, E>) -> Result<(), E> {
    *place = Some(make()?);
    Ok(())
}

/// An operation whose events, report and error are events of a task, the last ones its report.
pub(crate) struct Reported<O>(O);

/// An operation as a task.
pub(crate) fn run<O>(operation: O) -> Runner<Reported<O>> {
    Runner::new(Reported(operation))
}

impl<O: Operation> Operation for Reported<O>
where
    O::Event: Into<TaskEvent>,
    O::Report: Into<TaskEvent>,
    O::Error: Into<TaskEvent>,
{
    type Protocol = O::Protocol;
    type Event = TaskEvent;
    type Report = TaskEvent;
    type Error = Infallible;

    fn next(&mut self, now: Instant) -> StepOf<Self> {
        self.0.next(now)
    }

    fn result(&self) -> Option<Result<TaskEvent, Infallible>> {
        Some(Ok(match self.0.result()? {
            Ok(report) => report.into(),
            Err(error) => error.into(),
        }))
    }

    fn on(&mut self, outcome: &ExchangeOutcome<O::Protocol>) -> Option<TaskEvent> {
        self.0.on(outcome).map(Into::into)
    }

    fn progress(&self) -> TaskProgress {
        self.0.progress()
    }

    fn cancel(&mut self) {
        self.0.cancel();
    }

    fn is_exclusive(&self) -> bool {
        self.0.is_exclusive()
    }
}
