//! The buses: settings, state and load.

use clino_gateway::lint::{Finding, Lint, Part};
use clino_gateway::order::Order;
use clino_gateway::settings::bus::id;
use clino_gateway::settings::{self, Tabled};
use clino_gateway::{Bus, BusChange, BusFault, BusSettings};

use crate::host::BusWork;
use crate::job::{Job, Outcome};
use crate::label::Label;
use crate::reply::Reply;
use crate::rows::{of_bus, row_of};
use crate::settings::{Change, entries};
use crate::typed::Opt;
use crate::value::{Value, thousandths};

/// Options of `bus`, and the settings that they name.
const OPTIONS: [(Opt, u8); 5] = [
    (Opt(Some(b'b'), "baud"), id::BAUD),
    (Opt(Some(b'g'), "guard"), id::GUARD),
    (Opt(None, "pre"), id::PRE),
    (Opt(None, "post"), id::POST),
    (Opt(Some(b'e'), "echo"), id::ECHO),
];

/// `bus BUS`; with options it changes settings.
pub fn bus(job: &mut Job<'_, '_>) -> Outcome {
    let mut words = [None; OPTIONS.len()];
    for (word, (option, _)) in words.iter_mut().zip(&OPTIONS) {
        *word = job.option(*option)?;
    }
    let bus: Bus = job.one_of("bus")?;
    job.end()?;
    if words.iter().all(Option::is_none) {
        show(job, bus);
        return Ok(());
    }
    let mut change = Change::default();
    for (word, (_, id)) in words.iter().zip(&OPTIONS) {
        if let (Some(word), Some(row)) = (word, row_of(of_bus(bus), *id)) {
            change.name(*id, job.value(row, word)?);
        }
    }
    change_bus(job, bus, &change)
}

/// `set BUS SETTING VALUE`
pub fn set(job: &mut Job<'_, '_>, bus: Bus) -> Outcome {
    let mut change = Change::default();
    job.change(of_bus(bus), &mut change)?;
    job.end()?;
    change_bus(job, bus, &change)
}

/// How a bus is set, and whether it is out of order.
pub fn show(job: &mut Job<'_, '_>, bus: Bus) {
    let Some(settings) = &job.host.bus_settings(bus) else { return };
    job.reply.begin_list("bus", bus.name().into());
    let table = settings::bus::settings(bus);
    entries(&mut job.reply, &Tabled::new(table, settings), &|_| true);
    let fault = fault(job, bus);
    job.reply.entry(&Label::plain("fault"), fault.into());
    job.reply.end_list();
}

/// A function of its own, so that the stack of the state is free again at once.
#[inline(never)]
fn fault(job: &Job<'_, '_>, bus: Bus) -> Option<&'static str> {
    job.host.bus(bus).and_then(|state| state.health.fault).map(BusFault::name)
}

#[inline(never)]
fn change_bus(job: &mut Job<'_, '_>, bus: Bus, change: &Change) -> Outcome {
    let change = BusChange::named(bus, &|id| change.of(id)).map_err(|refusal| job.refused(&refusal))?;
    let result = job.host.order(Order::Bus { bus, change });
    job.accepted(result)?;
    // An exchange in hand goes on as it was begun.
    match job.host.bus_work(bus) {
        Some(BusWork { in_force: false, .. }) => job.reply.accepted(),
        _ => job.reply.done(),
    }
    Ok(())
}

/// `load`
pub fn load(job: &mut Job<'_, '_>) -> Outcome {
    job.end()?;
    let t7 = settings_of(job, Bus::T7);
    let isu = settings_of(job, Bus::Isu);
    let (host, reply) = (&*job.host, &mut job.reply);
    let slot = |slot: u8| host.config(slot.into());
    // The gateway does not keep the damping of a T7.
    let lint = Lint { slot: &slot, t7: &t7, isu: &isu, damping_ms: |_| None };
    for bus in Bus::ALL {
        load_of(reply, bus, lint.load(bus), job.meter.rate(bus));
    }
    lint.findings(&mut |finding| unwise(reply, &finding));
    Ok(())
}

#[inline(never)]
fn load_of(reply: &mut Reply<'_>, bus: Bus, wanted: u32, rate: Option<u32>) {
    let values = [wanted.into(), rate.map(thousandths).into()];
    reply.list("load wanted_percent polls_per_s", bus.name().into(), &values);
}

/// A function of its own, so that the stack of the rest is free again at once. Of a bus that this build does not have, the
/// first settings.
#[inline(never)]
fn settings_of(job: &mut Job<'_, '_>, bus: Bus) -> BusSettings {
    job.host.bus_settings(bus).filter(|_| bus.is_built()).unwrap_or(BusSettings::first(bus))
}

/// A configuration warning.
#[inline(never)]
fn unwise(reply: &mut Reply<'_>, finding: &Finding) {
    let (sentence, parts) = finding.words();
    let values = parts.map(|part| match part {
        Part::Number(number) => number.into(),
        Part::Name(name) => Value::Text(name),
    });
    reply.begin("unwise");
    if reply.is_for_people() {
        reply.say(": why ");
        reply.print(sentence, &values);
    } else {
        reply.why(sentence, &values);
    }
    reply.end();
}
