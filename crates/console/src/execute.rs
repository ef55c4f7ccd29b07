//! Carries out a line.

use crate::audience::Audience;
use crate::command::{Command, Verb};
use crate::error::UNKNOWN;
use crate::help::{describe, describe_all};
use crate::host::Host;
use crate::job::{Job, Outcome, Reported};
use crate::meter::Meter;
use crate::pending::Next;
use crate::presence::Presence;
use crate::reply::Reply;
use crate::typed::{self, Typed};
use crate::{alarms, buses, diagnostics, export, extremes, slots, system, tasks};

/// Carries out the line that was typed. Its next step goes into `next`, which is too large to be returned.
#[inline(never)]
pub fn execute<'j>(
    line: &str,
    reply: Reply<'j>,
    host: &'j mut dyn Host,
    meter: &'j Meter,
    presence: &'j Presence,
    next: &'j mut Next,
) {
    let now = host.now();
    *next = Next::Stay;
    let mut job = Job { typed: Typed::new(), reply, host, meter, presence, now, next };
    if let Err(Reported) = carry_out(&mut job, line) {
        *job.next = Next::Stay;
    }
}

/// Finds the command, and takes what follows its name. A function of its own: its stack is not below the command.
#[inline(never)]
fn begin<'a>(job: &mut Job<'_, 'a>, line: &'a str) -> Result<&'static Command, Reported> {
    let (name, rest) = typed::split(line);
    let command = command(job, if name == "?" { "help" } else { name })?;
    job.typed.take(rest).map_err(|mistake| job.mistaken(&mistake))?;
    Ok(command)
}

fn carry_out<'a>(job: &mut Job<'_, 'a>, line: &'a str) -> Outcome {
    let command = begin(job, line)?;
    if job.typed.help {
        describe(&mut job.reply, command);
        return Ok(());
    }
    action(command.verb)(job)
}

/// What a command does. Each is a function of its own, so that one does not pay for the stack of the others.
const fn action(verb: Verb) -> fn(&mut Job<'_, '_>) -> Outcome {
    match verb {
        Verb::List => slots::list,
        Verb::Read => slots::read,
        Verb::Watch => slots::watch,
        Verb::Slot => slots::slot,
        Verb::Show => slots::show,
        Verb::Set => slots::set,
        Verb::Zero => slots::zero,
        Verb::Bus => buses::bus,
        #[cfg(feature = "commissioning")]
        Verb::T7 => tasks::t7,
        #[cfg(all(feature = "commissioning", feature = "isu"))]
        Verb::Isu => tasks::isu,
        #[cfg(feature = "commissioning")]
        Verb::Cancel => tasks::cancel,
        Verb::Counters => diagnostics::counters,
        Verb::Trace => diagnostics::trace,
        Verb::Alarms => alarms::alarms,
        Verb::Acknowledge => alarms::acknowledge,
        Verb::Extremes => extremes::extremes,
        Verb::Load => buses::load,
        Verb::Export => export::export,
        #[cfg(feature = "modbus")]
        Verb::Modbus => system::modbus,
        Verb::Save => system::save,
        Verb::FactoryReset => system::factory_reset,
        Verb::Reboot => system::reboot,
        Verb::ResetCause => system::reset_cause,
        Verb::Version => system::version,
        Verb::Json => json,
        Verb::Help => help,
    }
}

/// `json on|off`
fn json(job: &mut Job<'_, '_>) -> Outcome {
    let programs = job.one_of("mode")?;
    job.end()?;
    let audience = if programs { Audience::Programs } else { Audience::People };
    // A program that begins or ends is told so in its own form.
    if programs {
        job.reply.audience = audience;
    }
    job.reply.done();
    *job.next = Next::Speak(audience);
    Ok(())
}

/// `help [COMMAND]`
fn help(job: &mut Job<'_, '_>) -> Outcome {
    match job.typed.next() {
        Some(name) => {
            let command = command(job, name)?;
            describe(&mut job.reply, command);
        }
        None => describe_all(&mut job.reply),
    }
    Ok(())
}

#[inline(never)]
fn command(job: &mut Job<'_, '_>, name: &str) -> Result<&'static Command, Reported> {
    Command::named(name).ok_or_else(|| job.refuse(UNKNOWN, &[]))
}
