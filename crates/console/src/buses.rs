//! The buses: how they run, and how much they have to do.

use clino_bus::{Micros, Timing};
use clino_gateway::lint::Lint;
use clino_gateway::order::{LONGEST_DELAY, LONGEST_GUARD, Order};
use clino_gateway::{Bus, BusChange};

use crate::host::BusState;
use crate::job::{Job, Outcome, Told};
use crate::meter::BUSES;
use crate::table;
use crate::typed::Opt;
use crate::value::Value;
use crate::words::Words as _;

const BAUD: Opt = Opt(Some('b'), "baud");
const GUARD: Opt = Opt(Some('g'), "guard");
const PRE: Opt = Opt(None, "pre");
const POST: Opt = Opt(None, "post");
const ECHO: Opt = Opt(Some('e'), "echo");

/// `bus BUS`, and with options what is to change.
pub fn bus(job: &mut Job<'_, '_>) -> Outcome {
    let mut words = [None; 5];
    for (word, option) in words.iter_mut().zip([BAUD, GUARD, PRE, POST, ECHO]) {
        *word = job.option(option)?;
    }
    let [baud, guard, pre, post, echo] = words;
    let bus: Bus = job.one_of("bus")?;
    job.end()?;
    if words.iter().all(Option::is_none) {
        if let Some(BusState { line, health, .. }) = job.host.bus(bus) {
            table::bus(&mut job.reply, bus, &line, health.fault);
        }
        return Ok(());
    }
    let change = BusChange {
        baud: baud.map(|word| job.up_to(word, "baud", u32::MAX)).transpose()?,
        guard: micros(job, guard, "guard_us", LONGEST_GUARD)?,
        pre_delay: micros(job, pre, "pre_us", LONGEST_DELAY)?,
        post_delay: micros(job, post, "post_us", LONGEST_DELAY)?,
        echo: echo.map(|word| job.meaning(word)).transpose()?,
    };
    let result = job.host.order(Order::Bus { bus, change });
    job.accepted(result)?;
    // An exchange in hand goes on as it was begun.
    match job.host.bus(bus) {
        Some(BusState { in_force: false, .. }) => job.reply.accepted(),
        _ => job.reply.done(),
    }
    Ok(())
}

#[inline(never)]
fn micros(
    job: &mut Job<'_, '_>,
    word: Option<&str>,
    what: &'static str,
    most: Micros,
) -> Result<Option<Micros>, Told> {
    let Some(word) = word else { return Ok(None) };
    let us = job.up_to(word, what, most.0 as u32)?;
    Ok(Some(Micros(us.into())))
}

/// `load`
pub fn load(job: &mut Job<'_, '_>) -> Outcome {
    job.end()?;
    let (Some(t7), Some(isu)) = (timing(job, Bus::T7), timing(job, Bus::Isu)) else { return Ok(()) };
    let (host, reply) = (&*job.host, &mut job.reply);
    let slot = |slot: u8| host.config(slot.into());
    // What a T7 averages over is not kept.
    let lint = Lint { slot: &slot, t7: &t7, isu: &isu, damping_ms: |_| None };
    for bus in BUSES {
        let rate = job.meter.rate(bus).map(|rate| Value::Thousandths(rate.into()));
        let values = [lint.load(bus).into(), rate.into()];
        reply.list("load", bus.name().into(), "wanted_percent polls_per_s", &values);
    }
    lint.findings(&mut |finding| reply.line("unwise", "why", &[Value::Words(&finding)]));
    Ok(())
}

/// A function of its own, so that the rest of what is told of a bus is forgotten at once.
#[inline(never)]
fn timing(job: &mut Job<'_, '_>, bus: Bus) -> Option<Timing> {
    job.host.bus(bus).map(|state| state.timing)
}
