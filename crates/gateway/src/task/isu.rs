//! Tasks on the ISU bus.

use clino_bus::{Isu, Serial};
use clino_codec::isu::eeprom::Change;
use clino_commissioning::isu::{
    Alive, Cause, Failure, Identify, Identity, Module, Nulled, Program, Repair, Repaired, Reset, ResetNull,
};
use clino_commissioning::{Report, Runner};

use super::{Claim, Reported, TaskRunner, Tasks, put, run};
use crate::config::{Bus, Source};

/// The tasks that can be ordered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Task {
    /// Identification of a module and its setup.
    Identify(Module),
    /// The module starts again.
    Reset(Module),
    /// The module reads zero as it stands.
    ResetNull(Module),
    /// A word of its EEPROM changes.
    Program(Module, Change),
    /// Its EEPROM's checksum is made right.
    Repair(Module),
}

/// An event of a task.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TaskEvent {
    /// A module's identification and setup.
    Identity(Identity),
    /// A module came up again.
    Alive(Alive),
    /// What a module read before and after it was set to zero.
    Nulled(Nulled),
    /// What became of a setting.
    Programmed(Report<Change>),
    /// A module works again.
    Repaired(Repaired),
    /// It did not work.
    Failed(Failure),
}

/// A task under way.
pub(crate) enum Work {
    Identify(Runner<Reported<Identify>>),
    Reset(Runner<Reported<Reset>>),
    ResetNull(Runner<Reported<ResetNull>>),
    Program(Runner<Reported<Program>>),
    Repair(Runner<Reported<Repair>>),
}

impl Work {
    /// Begins a task, in its place: it is large.
    ///
    /// # Errors
    /// An address that no single module can have.
    #[inline(never)]
    pub fn begin(task: &Task, place: &mut Option<Work>) -> Result<(), Cause> {
        match *task {
            Task::Identify(module) => put(place, || Ok(Work::Identify(run(Identify::new(module))))),
            Task::Reset(module) => put(place, || Ok(Work::Reset(run(Reset::new(module))))),
            Task::ResetNull(module) => put(place, || Ok(Work::ResetNull(run(ResetNull::new(module))))),
            Task::Program(module, change) => {
                put(place, || Ok(Work::Program(run(Program::new(module, change)?))))
            }
            Task::Repair(module) => put(place, || Ok(Work::Repair(run(Repair::new(module))))),
        }
    }

    /// Whether it can begin.
    #[inline(never)]
    pub fn check(task: &Task) -> Result<(), Cause> {
        match *task {
            Task::Program(module, change) => Program::new(module, change).map(|_| ()),
            _ => Ok(()),
        }
    }
}

#[cfg(feature = "commissioning")]
impl Tasks for Isu {
    type Task = Task;
    type Work = Work;

    fn begin(task: &Task, _: Serial, place: &mut Option<Work>) -> Result<(), super::TaskEvent> {
        let refused = |cause| Failure { cause, writes: 0, repair: false }.into();
        Work::begin(task, place).map_err(refused)
    }

    fn claim(task: &Task) -> Claim {
        match *task {
            Task::ResetNull(module) => Claim::Zero(Source::Isu { address: module.address() }),
            Task::Program(module, Change::ModuleAddress(to)) => {
                Claim::Addresses(Bus::Isu, [module.address().get(), to.get()])
            }
            Task::Identify(_) | Task::Reset(_) | Task::Program(..) | Task::Repair(_) => Claim::Nothing,
        }
    }

    fn runner(work: &mut Work) -> &mut TaskRunner<Isu> {
        match work {
            Work::Identify(runner) => runner,
            Work::Reset(runner) => runner,
            Work::ResetNull(runner) => runner,
            Work::Program(runner) => runner,
            Work::Repair(runner) => runner,
        }
    }

    fn runner_ref(work: &Work) -> &TaskRunner<Isu> {
        match work {
            Work::Identify(runner) => runner,
            Work::Reset(runner) => runner,
            Work::ResetNull(runner) => runner,
            Work::Program(runner) => runner,
            Work::Repair(runner) => runner,
        }
    }
}

macro_rules! news {
    ($($from:ty => $variant:ident),* $(,)?) => {$(
        impl From<$from> for super::TaskEvent {
            #[inline(never)]
            fn from(news: $from) -> Self {
                super::TaskEvent::Isu(TaskEvent::$variant(news))
            }
        }
    )*};
}

news! {
    Identity => Identity,
    Alive => Alive,
    Nulled => Nulled,
    Report<Change> => Programmed,
    Repaired => Repaired,
    Failure => Failed,
}
