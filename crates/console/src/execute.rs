//! Carries out a line.

use crate::audience::Audience;
use crate::command::{Command, Verb, describe_all};
use crate::error::Error;
use crate::host::Host;
use crate::job::{Job, Outcome, Reported};
use crate::meter::Meter;
use crate::pending::{Next, Pending};
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

fn carry_out<'a>(job: &mut Job<'_, 'a>, line: &'a str) -> Outcome {
    let (name, rest) = typed::split(line);
    let command = command(job, if name == "?" { "help" } else { name })?;
    job.typed.take(rest).map_err(|error| job.refuse(&error))?;
    if job.typed.help {
        command.describe(&mut job.reply);
        return Ok(());
    }
    match command.verb {
        Verb::List => slots::list(job),
        Verb::Read => slots::read(job),
        Verb::Watch => slots::watch(job),
        Verb::Slot => slots::slot(job),
        Verb::Show => slots::show(job),
        Verb::Set => slots::set(job),
        Verb::Zero => slots::zero(job),
        Verb::Bus => buses::bus(job),
        Verb::T7 => tasks::t7(job),
        Verb::Isu => tasks::isu(job),
        Verb::Cancel => tasks::cancel(job),
        Verb::Counters => diagnostics::counters(job),
        Verb::Trace => diagnostics::trace(job),
        Verb::Alarms => alarms::alarms(job),
        Verb::Acknowledge => alarms::acknowledge(job),
        Verb::Extremes => extremes::extremes(job),
        Verb::Load => buses::load(job),
        Verb::Export => export::export(job),
        Verb::Modbus => system::modbus(job),
        Verb::Save => system::save(job),
        Verb::FactoryReset => job.confirmed(Pending::FactoryReset),
        Verb::Reboot => job.confirmed(Pending::Reboot),
        Verb::ResetCause => system::reset_cause(job),
        Verb::Version => system::version(job),
        Verb::Json => {
            let programs = job.one_of("mode")?;
            job.end()?;
            *job.next = Next::Speak(if programs { Audience::Programs } else { Audience::People });
            Ok(())
        }
        Verb::Help => {
            match job.typed.next() {
                Some(name) => self::command(job, name)?.describe(&mut job.reply),
                None => describe_all(&mut job.reply),
            }
            Ok(())
        }
    }
}

fn command(job: &mut Job<'_, '_>, name: &str) -> Result<&'static Command, Reported> {
    Command::named(name).ok_or_else(|| job.refuse(&Error::Unknown))
}
