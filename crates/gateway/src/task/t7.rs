//! Tasks on the T7 bus.

use core::convert::Infallible;

use clino_bus::{Serial, T7};
use clino_codec::t7::{Address, Axis, BaudRate, EncodeError};
use clino_commissioning::t7::{
    Cause, ChangeAddress, ChangeBaud, Device, DeviceSetting, Failure, Found, Identify, Identity, Rates, Set,
    SetZero, Sweep, Swept, Zeroed,
};
use clino_commissioning::{Report, Runner};

use super::{Claim, Reported, TaskRunner, Tasks, put, run};
use crate::config::{Bus, Source};

/// The tasks that can be ordered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Task {
    /// Identification of a device and its setup.
    Identify(Device),
    /// Every address at these bit rates.
    Sweep(Rates),
    /// The axis reads zero as it stands.
    Zero(Device, Axis),
    /// A setting gets a value.
    Set(Device, DeviceSetting),
    /// The device moves from one address to another.
    Address {
        /// Where it is.
        from: Address,
        /// Where it goes.
        to: Address,
    },
    /// The device, and the line with it, changes its bit rate.
    Baud(Device, BaudRate),
}

/// An event of a task.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TaskEvent {
    /// A sweep has found something. More follows.
    Found(Found),
    /// A sweep is over.
    Swept(Swept),
    /// A device's identification and setup.
    Identity(Identity),
    /// What an axis read before and after it was set to zero.
    Zeroed(Zeroed),
    /// What became of a setting.
    Set(Report<DeviceSetting>),
    /// What became of an address.
    Address(Report<Address>),
    /// What became of a bit rate.
    Baud(Report<BaudRate>),
    /// It did not work.
    Failed(Failure),
}

/// A task under way.
pub(crate) enum Work {
    Identify(Runner<Reported<Identify>>),
    Sweep(Runner<Reported<Sweep>>),
    Zero(Runner<Reported<SetZero>>),
    Set(Runner<Reported<Set>>),
    Address(Runner<Reported<ChangeAddress>>),
    Baud(Runner<Reported<ChangeBaud>>),
}

impl Work {
    /// Begins a task on a line that runs like this, in its place.
    ///
    /// # Errors
    /// A parameter out of its range, or a command that must not go to all.
    #[inline(never)]
    pub fn begin(task: &Task, serial: Serial, place: &mut Option<Work>) -> Result<(), EncodeError> {
        // The line has no other rate than those of a T7: orders for others are refused.
        let line = BaudRate::from_bits_per_second(serial.baud).unwrap_or(BaudRate::B115200);
        match *task {
            Task::Identify(device) => put(place, || Ok(Work::Identify(run(Identify::new(device)?)))),
            Task::Sweep(rates) => put(place, || Ok(Work::Sweep(run(Sweep::new(serial, rates))))),
            Task::Zero(device, axis) => put(place, || Ok(Work::Zero(run(SetZero::new(device, axis))))),
            Task::Set(device, setting) => put(place, || Ok(Work::Set(run(Set::new(device, setting)?)))),
            Task::Address { from, to } => {
                put(place, || Ok(Work::Address(run(ChangeAddress::new(from, to)?))))
            }
            Task::Baud(device, rate) => {
                put(place, || Ok(Work::Baud(run(ChangeBaud::new(device, line, rate)?))))
            }
        }
    }

    /// Whether it can begin.
    #[inline(never)]
    pub fn check(task: &Task) -> Result<(), EncodeError> {
        match *task {
            Task::Identify(device) => Identify::new(device).map(|_| ()),
            Task::Sweep(_) | Task::Zero(..) => Ok(()),
            Task::Set(device, setting) => Set::new(device, setting).map(|_| ()),
            Task::Address { from, to } => ChangeAddress::new(from, to).map(|_| ()),
            Task::Baud(device, rate) => ChangeBaud::new(device, BaudRate::B115200, rate).map(|_| ()),
        }
    }
}

#[cfg(feature = "commissioning")]
impl Tasks for T7 {
    type Task = Task;
    type Work = Work;

    fn begin(task: &Task, serial: Serial, place: &mut Option<Work>) -> Result<(), super::TaskEvent> {
        let refused = |error| Failure { cause: Cause::Refused(error), writes: 0 }.into();
        Work::begin(task, serial, place).map_err(refused)
    }

    fn claim(task: &Task) -> Claim {
        match *task {
            Task::Zero(device, axis) => Claim::Zero(Source::T7 { address: device.address(), axis }),
            Task::Address { from, to } => Claim::Addresses(Bus::T7, [from.get(), to.get()]),
            Task::Baud(..) => Claim::BitRate,
            Task::Identify(_) | Task::Sweep(_) | Task::Set(..) => Claim::Nothing,
        }
    }

    fn runner(work: &mut Work) -> &mut TaskRunner<T7> {
        match work {
            Work::Identify(runner) => runner,
            Work::Sweep(runner) => runner,
            Work::Zero(runner) => runner,
            Work::Set(runner) => runner,
            Work::Address(runner) => runner,
            Work::Baud(runner) => runner,
        }
    }

    fn runner_ref(work: &Work) -> &TaskRunner<T7> {
        match work {
            Work::Identify(runner) => runner,
            Work::Sweep(runner) => runner,
            Work::Zero(runner) => runner,
            Work::Set(runner) => runner,
            Work::Address(runner) => runner,
            Work::Baud(runner) => runner,
        }
    }
}

impl From<Infallible> for super::TaskEvent {
    fn from(never: Infallible) -> Self {
        match never {}
    }
}

macro_rules! news {
    ($($from:ty => $variant:ident),* $(,)?) => {$(
        impl From<$from> for super::TaskEvent {
            #[inline(never)]
            fn from(news: $from) -> Self {
                super::TaskEvent::T7(TaskEvent::$variant(news))
            }
        }
    )*};
}

news! {
    Found => Found,
    Swept => Swept,
    Identity => Identity,
    Zeroed => Zeroed,
    Report<DeviceSetting> => Set,
    Report<Address> => Address,
    Report<BaudRate> => Baud,
    Failure => Failed,
}
