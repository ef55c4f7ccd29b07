//! Side effects of an order: named in the question to a person, and in the answers for programs.

use clino_codec::isu::eeprom;
use clino_commissioning::t7::DeviceSetting;
use clino_commissioning::{Report, SettingChange};
use clino_gateway::Consequence;
use clino_gateway::task::{TaskEvent, isu, t7};

use crate::causes;
use crate::error::{UNCONFIRMED, UNCONFIRMED_SHARED, UNCONFIRMED_SILENCED};
use crate::features::COMMISSIONING;
use crate::reply::Reply;
use crate::sensor_task::SensorTask;
use crate::split::split_before;
use crate::value::Value;

/// Tells a person the effects of a task on the sensor, its slots and other nodes.
#[inline(never)]
pub fn tell(task: &SensorTask, consequence: Consequence, reply: &mut Reply<'_>) {
    if !COMMISSIONING {
        return;
    }
    reply.say("this writes to the sensor's memory");
    let rate = match task {
        SensorTask::T7(t7::Task::Baud(_, rate)) => rate.bits_per_second(),
        _ => 0,
    };
    reply.print(effect(task), &[rate.into()]);
    if let Some(Effect { row, values, .. }) = Effect::of(consequence) {
        reply.say("; ");
        reply.print(sentence(row), &values);
    }
}

const fn effect(task: &SensorTask) -> &'static str {
    match task {
        SensorTask::T7(task) => of_t7(task),
        SensorTask::Isu(task) => of_isu(task),
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
        Task::Baud(..) => "; the bus changes to {0} bit/s, too; only save keeps that over a restart",
        Task::Identify(_) | Task::Sweep(_) => "",
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

/// Effect of an order on other nodes and slots.
struct Effect {
    /// The error of a program that has not confirmed it.
    row: &'static str,
    /// The note when no question is asked: its kind, and the name of the first value.
    note: &'static str,
    values: [Value<'static>; 3],
}

impl Effect {
    #[inline(never)]
    fn of(consequence: Consequence) -> Option<Effect> {
        let Consequence { silenced, shared } = consequence;
        let (row, note, first) = match shared {
            _ if silenced > 0 => (UNCONFIRMED_SILENCED, "silenced silenced", silenced),
            Some(slot) => (UNCONFIRMED_SHARED, "shared slot", slot),
            None => return None,
        };
        let (nodes, verb) = if silenced == 1 { ("node", "stays") } else { ("nodes", "stay") };
        Some(Effect { row, note, values: [first.into(), nodes.into(), verb.into()] })
    }
}

/// What an error of a program that has not confirmed says of the effect.
fn sentence(row: &'static str) -> &'static str {
    let (_, sentence) = split_before(row, b'|');
    let (effect, _) = split_before(sentence, b';');
    effect.strip_prefix('|').unwrap_or("")
}

/// Writes the error of a program that has not confirmed.
#[inline(never)]
pub fn unconfirmed(reply: &mut Reply<'_>, consequence: Consequence) {
    match Effect::of(consequence) {
        Some(Effect { row, values, .. }) => reply.refuse(row, &values),
        None => reply.refuse(UNCONFIRMED, &[]),
    }
}

/// Notes it in the answer when no question is asked.
#[inline(never)]
pub fn warn(reply: &mut Reply<'_>, consequence: Consequence) {
    if let Some(Effect { row, note, values }) = Effect::of(consequence) {
        reply.hint(note, sentence(row), &values);
    }
}

/// Names the step that remains after a task.
#[inline(never)]
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
    reply.hint("unsaved", why, &[]);
}

/// What to do next, for people: a program has the cause.
fn advise(reply: &mut Reply<'_>, step: Option<&'static str>) {
    if let Some(step) = step.filter(|_| reply.is_for_people()) {
        reply.hint("next", step, &[]);
    }
}
