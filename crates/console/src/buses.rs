//! The buses: how they run, and how much they have to do.

use clino_bus::{Micros, Serial, Timing, line};
use clino_gateway::Bus;
use clino_gateway::lint::Lint;
use clino_gateway::order::{LONGEST_DELAY, LONGEST_GUARD, Order};

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
    let Some(BusState { mut timing, mut line, health, .. }) = job.host.bus(bus) else { return Ok(()) };
    if words.iter().all(Option::is_none) {
        table::bus(&mut job.reply, bus, &line, health.fault);
        return Ok(());
    }
    if let Some(word) = baud {
        let serial = Serial { baud: job.up_to(word, "baud", u32::MAX)? };
        timing = match bus {
            Bus::T7 => Timing::t7(serial),
            Bus::Isu => Timing { serial, ..Timing::isu() },
        };
    }
    micros(job, guard, "guard_us", LONGEST_GUARD, &mut timing.guard)?;
    line = line::Settings { serial: timing.serial, guard: timing.guard, ..line };
    micros(job, pre, "pre_us", LONGEST_DELAY, &mut line.pre_delay)?;
    micros(job, post, "post_us", LONGEST_DELAY, &mut line.post_delay)?;
    if let Some(word) = echo {
        line.echo = job.meaning(word)?;
    }
    job.order(Order::Bus { bus, timing, line })
}

#[inline(never)]
fn micros(
    job: &mut Job<'_, '_>,
    word: Option<&str>,
    what: &'static str,
    most: Micros,
    place: &mut Micros,
) -> Result<(), Told> {
    if let Some(word) = word {
        *place = Micros(job.up_to(word, what, most.0 as u32)?.into());
    }
    Ok(())
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
