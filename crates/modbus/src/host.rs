//! The interface from the server to the gateway. [`Binding`](crate::binding::Binding) implements it.

use clino_gateway::Bus;

use crate::command::Command;
use crate::exception::Exception;
use crate::settings::Settings;
use crate::values::Values;

/// The gateway as the server sees it.
///
/// A request is answered from one state: the server calls [`Host::begin`] before it reads anything for it, and ages are
/// as of then until the next call. If an interrupt publishes something in between, the host says so in the end
/// ([`Host::held_still`]), and the server begins again.
pub trait Host {
    /// A request begins: notes the state that it is answered from.
    fn begin(&mut self);

    /// Whether all that was read since is of that state.
    fn held_still(&self) -> bool;

    /// The status bits of the gateway.
    fn status(&self) -> u16;

    /// Hands out registers, beginning with `first`, one after the other. `port` is how the server's port runs.
    ///
    /// # Errors
    /// There is no such register.
    fn read(
        &self,
        port: &Settings,
        first: u16,
        quantity: u16,
        take: &mut dyn FnMut(u16),
    ) -> Result<(), Exception>;

    /// Checks a change, and makes it if nothing is wrong with it: whole or not at all. Changes hold until reset,
    /// unless [`Command::Save`] follows.
    ///
    /// # Errors
    /// [`Refusal`]; nothing has changed then.
    fn write(&mut self, write: &Write<'_>) -> Result<(), Refusal>;
}

/// Something that is to change. One request changes one thing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Write<'a> {
    /// How a slot is set.
    Slot(u8, Values<'a>),
    /// How a bus is set.
    Bus(Bus, Values<'a>),
    /// How the console is set.
    Console(Values<'a>),
    /// How this server's port runs. Valid already; in force as soon as the answer is out.
    Port(Settings),
    /// Something to do. The arm key was there if it takes one.
    Command {
        /// What.
        command: Command,
        /// The slot or the bus of the command.
        target: u16,
        /// With this value.
        value: i32,
        /// The arm key was there.
        armed: bool,
    },
}

/// Why a change is not made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Refusal {
    /// A value is out of its range, or does not go with another: exception 03.
    Value,
    /// It cannot be done: exception 04.
    Failed,
    /// Something else is under way: exception 06.
    Busy,
}

impl From<clino_gateway::order::Refusal> for Refusal {
    fn from(refusal: clino_gateway::order::Refusal) -> Refusal {
        use clino_gateway::order::Refusal as Core;
        match refusal {
            Core::Busy => Refusal::Busy,
            Core::Degraded(_) => Refusal::Failed,
            _ => Refusal::Value,
        }
    }
}
