//! What an order does besides what it says: told before a person is asked, and in the answers for programs.

use core::fmt::{self, Display, Write};

use clino_codec::isu::eeprom;
use clino_commissioning::t7::DeviceSetting;
use clino_commissioning::{Report, SettingChange};
use clino_gateway::Consequence;
use clino_gateway::order::Order;
use clino_gateway::task::{News, isu, t7};

use crate::causes;
use crate::reply::Reply;
use crate::value::Value;

/// Tells a person what a task will do to the sensor, its slots and others.
#[inline(never)]
pub fn tell(order: &Order, consequence: Consequence, out: &mut dyn Write) {
    _ = out.write_str("this writes to the sensor's memory");
    match order {
        Order::T7(t7::Task::Baud(_, rate)) => {
            let rate = rate.bits_per_second();
            _ = write!(out, "; the bus runs at {rate} bit/s with it, over a start only if saved");
        }
        order => _ = out.write_str(effect(order)),
    }
    if consequence != Consequence::NONE {
        _ = write!(out, "; {}", Told(consequence));
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
        Task::Zero(..) => "; its axis reads zero as it stands, the soft zeros of its slots go",
        Task::Set(_, DeviceSetting::Offset { .. }) => "; all angles of its axis move",
        Task::Set(_, DeviceSetting::Direction { .. }) => "; its axis counts the other way",
        Task::Set(_, DeviceSetting::Damping(_)) => "; all its axes average over this time",
        Task::Set(_, DeviceSetting::Range(_)) => "; all its axes are told in this range",
        Task::Address { .. } => "; its slots follow it, over a start only if saved",
        Task::Identify(_) | Task::Sweep(_) | Task::Baud(..) => "",
    }
}

const fn of_isu(task: &isu::Task) -> &'static str {
    use isu::Task;
    match task {
        Task::ResetNull(_) => {
            "; it reads zero as it stands, at its PWM output, too; the soft zeros of its slots go"
        }
        Task::Program(_, eeprom::Change::NullPosition(_)) => {
            "; all its angles move, at its PWM output, too; it starts again"
        }
        Task::Program(_, eeprom::Change::ModuleAddress(_)) => {
            "; it starts again, its slots follow it, over a start of the gateway only if saved"
        }
        Task::Program(..) | Task::Repair(_) => "; it starts again",
        Task::Identify(_) | Task::Reset(_) => "",
    }
}

/// What an order does to others, in words.
pub struct Told(pub Consequence);

impl Display for Told {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Consequence { silenced: 0, shared: None } => Ok(()),
            Consequence { silenced: 0, shared: Some(slot) } => {
                write!(out, "slot {slot} reads the new address already")
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

/// Tells of it when no question is asked.
#[inline(never)]
pub fn warn(reply: &mut Reply<'_>, consequence: Consequence) {
    match consequence {
        Consequence { silenced: 0, shared: None } => {}
        Consequence { shared: Some(slot), .. } => {
            reply.hint("shared", &Told(consequence), "slot", &[slot.into()]);
        }
        Consequence { silenced, .. } => {
            reply.hint("silenced", &Told(consequence), "silenced", &[silenced.into()]);
        }
    }
}

/// Tells what is left to be done after a task.
pub fn remind(reply: &mut Reply<'_>, news: &News) {
    let why = match news {
        News::T7(t7::News::Baud(Report { change: SettingChange::Changed { .. }, .. })) => {
            "save keeps the bit rate of the bus over a start"
        }
        News::T7(t7::News::Address(Report { change: SettingChange::Changed { .. }, .. }))
        | News::Isu(isu::News::Programmed(Report {
            change: SettingChange::Changed { to: eeprom::Change::ModuleAddress(_), .. },
            ..
        })) => "save keeps the new address in its slots over a start",
        News::T7(t7::News::Failed(failure)) => return advise(reply, causes::after_t7(&failure.cause)),
        News::Isu(isu::News::Failed(failure)) => return advise(reply, causes::after_isu(&failure.cause)),
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
