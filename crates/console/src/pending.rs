//! The result of a command; irreversible actions wait here for their confirmation.

use clino_gateway::order::Refusal;
use clino_gateway::{Bus, Consequence};

use crate::audience::Audience;
use crate::consequences;
use crate::error;
use crate::host::Host;
use crate::reply::Reply;
use crate::sensor_task::SensorTask;

/// The next step after a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Next {
    /// The next command.
    Stay,
    /// Readings as they come.
    Stream,
    /// Another audience.
    Speak(Audience),
    /// A task has begun on this bus.
    Task(Bus),
    /// Asks a person for confirmation.
    Ask(Pending),
    /// Confirmed with the command. The caller that has read the line carries it out: it has more stack below it.
    CarryOut(Pending),
}

/// An irreversible action.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pending {
    /// A task that writes to the memory of a sensor. It wears, and the sensor keeps it.
    Task(SensorTask, Consequence),
    /// All settings are kept, in place of some that were not taken over at this start.
    Save,
    /// The saved settings are discarded.
    FactoryReset,
    /// The gateway restarts. Unsaved settings are lost.
    Reboot,
}

impl Pending {
    /// Asks a person.
    #[inline(never)]
    pub fn ask(&self, reply: &mut Reply<'_>) {
        match self {
            Pending::Task(task, consequence) => consequences::tell(task, *consequence, reply),
            Pending::Save => reply.say("this replaces saved settings that were not read at this start"),
            Pending::FactoryReset => reply.say("this discards the saved settings"),
            Pending::Reboot => reply.say("unsaved settings are lost"),
        }
        reply.say(". Go on? y/N ");
    }

    /// Its effect on other nodes and slots.
    pub const fn consequence(&self) -> Consequence {
        match self {
            Pending::Task(_, consequence) => *consequence,
            Pending::Save | Pending::FactoryReset | Pending::Reboot => Consequence::NONE,
        }
    }

    /// Carries it out, or writes the reason for the refusal.
    #[inline(never)]
    pub fn carry_out(&self, host: &mut dyn Host, reply: &mut Reply<'_>) -> Next {
        let stored = match self {
            Pending::Task(task, _) => match host.order(task.order()) {
                Ok(()) => return Next::Task(task.bus()),
                Err(refusal) => {
                    error::refused(reply, &refusal);
                    return Next::Stay;
                }
            },
            // A sensor whose memory is being written must not be left half way.
            Pending::Reboot if is_at_work(host) => {
                error::refused(reply, &Refusal::Busy);
                return Next::Stay;
            }
            Pending::Reboot => {
                reply.done();
                host.reboot();
                return Next::Stay;
            }
            Pending::Save => host.save().map(Some),
            Pending::FactoryReset => host.factory_reset().map(|()| None),
        };
        match stored {
            Ok(None) => reply.done(),
            Ok(Some(saved)) => reply.line("saved stored", &[saved.name().into()]),
            Err(error) => reply.refuse(error.name(), &[]),
        }
        Next::Stay
    }
}

/// Whether there is a task on any bus.
pub fn is_at_work(host: &dyn Host) -> bool {
    Bus::ALL.iter().any(|&bus| host.bus_work(bus).is_some_and(|work| work.progress.is_some()))
}
