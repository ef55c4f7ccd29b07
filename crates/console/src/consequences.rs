//! Side effects of an order: named in the question to a person, and in the answers for programs.

use core::fmt::{self, Display, Write};

use clino_codec::isu::eeprom;
use clino_commissioning::t7::DeviceSetting;
use clino_commissioning::{Report, SettingChange};
use clino_gateway::Consequence;
use clino_gateway::order::Order;
use clino_gateway::task::{TaskEvent, isu, t7};

use crate::causes;
use crate::reply::Reply;
use crate::value::Value;

/// Tells a person the effects of a task on the sensor, its slots and other nodes.
#[inline(never)]
pub fn tell(order: &Order, consequence: Consequence, out: &mut dyn Write) {
    _ = out.write_str("this writes to the sensor's memory");
    match order {
        Order::T7(t7::Task::Baud(_, rate)) => {
            let rate = rate.bits_per_second();
            _ = write!(out, "; the bus changes to {rate} bit/s, too; only save keeps that over a restart");
        }
        order => _ = out.write_str(effect(order)),
    }
    if consequence != Consequence::NONE {
        _ = write!(out, "; {}", Effect(consequence));
    }
}

const fn effect(order: &Order) -> &'static str {
    match order {
        Order::T7(task) => of_t7(task),
        Order::Isu(task) => of_isu(task),
        _ => "",
    }
}

const fn of_t7(task: &t7::Task) -> &'static str {
    use t7::Task;
    match task {
        Task::Zero(..) => {
            "; its axis then reads zero in its present position; the soft zeros of its slots are cleared"
        }
        Task::Set(_, DeviceSetting::Offset { .. }) => "; all angles of its axis move",
        Task::Set(_, DeviceSetting::Direction { .. }) => "; its axis then counts the other way",
        Task::Set(_, DeviceSetting::Damping(_)) => "; all its axes average over this time",
        Task::Set(_, DeviceSetting::Range(_)) => "; all its axes then use this range",
        Task::Address { .. } => "; its slots follow it; only save keeps that over a restart",
        Task::Identify(_) | Task::Sweep(_) | Task::Baud(..) => "",
    }
}

const fn of_isu(task: &isu::Task) -> &'static str {
    use isu::Task;
    match task {
        Task::ResetNull(_) => {
            "; it then reads zero in its present position, at its PWM output, too; \
             the soft zeros of its slots are cleared"
        }
        Task::Program(_, eeprom::Change::NullPosition(_)) => {
            "; all its angles move, at its PWM output, too; it restarts"
        }
        Task::Program(_, eeprom::Change::ModuleAddress(_)) => {
            "; it restarts; its slots follow it; only save keeps that over a restart of the gateway"
        }
        Task::Program(..) | Task::Repair(_) => "; it restarts",
        Task::Identify(_) | Task::Reset(_) => "",
    }
}

/// Effect of an order on other nodes and slots, in words.
pub struct Effect(pub Consequence);

impl Display for Effect {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Consequence { silenced: 0, shared: None } => Ok(()),
            Consequence { silenced: 0, shared: Some(slot) } => {
                write!(out, "slot {slot} already reads the new address")
            }
            Consequence { silenced, .. } => {
                let (nodes, verbs) = if silenced == 1 { ("node", "stays") } else { ("nodes", "stay") };
                write!(
                    out,
                    "{silenced} other {nodes} of the bus {verbs} at its present bit rate and will not answer"
                )
            }
        }
    }
}

/// The same with a name, behind `why`.
pub fn named(consequence: Consequence) -> (&'static str, Value<'static>) {
    match consequence.shared {
        Some(slot) => ("why slot", slot.into()),
        None => ("why silenced", consequence.silenced.into()),
    }
}

/// Notes it in the answer when no question is asked.
#[inline(never)]
pub fn warn(reply: &mut Reply<'_>, consequence: Consequence) {
    match consequence {
        Consequence { silenced: 0, shared: None } => {}
        Consequence { shared: Some(slot), .. } => {
            reply.hint("shared", &Effect(consequence), "slot", &[slot.into()]);
        }
        Consequence { silenced, .. } => {
            reply.hint("silenced", &Effect(consequence), "silenced", &[silenced.into()]);
        }
    }
}

/// Names the step that remains after a task.
pub fn remind(reply: &mut Reply<'_>, news: &TaskEvent) {
    let why = match news {
        TaskEvent::T7(t7::TaskEvent::Baud(Report { change: SettingChange::Changed { .. }, .. })) => {
            "only save keeps the bit rate of the bus over a restart"
        }
        TaskEvent::T7(t7::TaskEvent::Address(Report { change: SettingChange::Changed { .. }, .. }))
        | TaskEvent::Isu(isu::TaskEvent::Programmed(Report {
            change: SettingChange::Changed { to: eeprom::Change::ModuleAddress(_), .. },
            ..
        })) => "only save keeps the new address in its slots over a restart",
        TaskEvent::T7(t7::TaskEvent::Failed(failure)) => {
            return advise(reply, causes::after_t7(&failure.cause));
        }
        TaskEvent::Isu(isu::TaskEvent::Failed(failure)) => {
            return advise(reply, causes::after_isu(&failure.cause));
        }
        _ => return,
    };
    reply.hint("unsaved", &why, "", &[]);
}

/// What to do next, for people: a program has the cause.
fn advise(reply: &mut Reply<'_>, step: Option<&'static str>) {
    if let Some(step) = step.filter(|_| reply.is_for_people()) {
        reply.hint("next", &step, "", &[]);
    }
}
