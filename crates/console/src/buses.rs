//! The buses: settings, state and load.

use clino_gateway::lint::Lint;
use clino_gateway::order::Order;
use clino_gateway::settings;
use clino_gateway::settings::bus::id;
use clino_gateway::{Bus, BusChange, BusFault, BusSettings};

use crate::error::Error;
use crate::host::BusState;
use crate::job::{Job, Outcome};
use crate::meter::BUSES;
use crate::settings::{Change, entries};
use crate::typed::Opt;
use crate::value::{Label, Value};

/// Options of `bus`, and the settings that they name.
const OPTIONS: [(Opt, u8); 5] = [
    (Opt(Some('b'), "baud"), id::BAUD),
    (Opt(Some('g'), "guard"), id::GUARD),
    (Opt(None, "pre"), id::PRE),
    (Opt(None, "post"), id::POST),
    (Opt(Some('e'), "echo"), id::ECHO),
];

/// `bus BUS`; with options it changes settings.
pub fn bus(job: &mut Job<'_, '_>) -> Outcome {
    let mut words = [None; OPTIONS.len()];
    for (word, (option, _)) in words.iter_mut().zip(OPTIONS) {
        *word = job.option(option)?;
    }
    let bus: Bus = job.one_of("bus")?;
    job.end()?;
    if words.iter().all(Option::is_none) {
        show(job, bus);
        return Ok(());
    }
    let mut change = Change::default();
    for (word, (_, id)) in words.into_iter().zip(OPTIONS) {
        let setting = settings::bus::settings(bus).iter().find(|setting| setting.id == id);
        if let (Some(word), Some(setting)) = (word, setting) {
            change.name(id, job.value(setting, word)?);
        }
    }
    change_bus(job, bus, &change)
}

/// `set BUS SETTING VALUE`
pub fn set(job: &mut Job<'_, '_>, bus: Bus) -> Outcome {
    let change = job.change(settings::bus::settings(bus), &settings::bus::NAMES)?;
    job.end()?;
    change_bus(job, bus, &change)
}

/// How a bus is set, and whether it is out of order.
pub fn show(job: &mut Job<'_, '_>, bus: Bus) {
    let Some(BusState { settings, health, .. }) = job.host.bus(bus) else { return };
    job.reply.begin_list("bus", bus.name().into());
    entries(&mut job.reply, settings::bus::settings(bus), &settings, |_| true);
    job.reply.entry(Label::plain("fault"), health.fault.map(BusFault::name).into());
    job.reply.end_list();
}

#[inline(never)]
fn change_bus(job: &mut Job<'_, '_>, bus: Bus, change: &Change) -> Outcome {
    let change =
        BusChange::named(bus, &|id| change.of(id)).map_err(|refusal| job.refuse(&Error::Refused(refusal)))?;
    let result = job.host.order(Order::Bus { bus, change });
    job.accepted(result)?;
    // An exchange in hand goes on as it was begun.
    match job.host.bus(bus) {
        Some(BusState { in_force: false, .. }) => job.reply.accepted(),
        _ => job.reply.done(),
    }
    Ok(())
}

/// `load`
pub fn load(job: &mut Job<'_, '_>) -> Outcome {
    job.end()?;
    let (Some(t7), Some(isu)) = (of_bus(job, Bus::T7), of_bus(job, Bus::Isu)) else { return Ok(()) };
    let (host, reply) = (&*job.host, &mut job.reply);
    let slot = |slot: u8| host.config(slot.into());
    // The gateway does not keep the damping of a T7.
    let lint = Lint { slot: &slot, t7: &t7, isu: &isu, damping_ms: |_| None };
    for bus in BUSES {
        let rate = job.meter.rate(bus).map(|rate| Value::Thousandths(rate.into()));
        let values = [lint.load(bus).into(), rate.into()];
        reply.list("load", bus.name().into(), "wanted_percent polls_per_s", &values);
    }
    lint.findings(&mut |finding| reply.line("unwise", "why", &[Value::Words(&finding)]));
    Ok(())
}

/// A function of its own, so that the stack of the rest is free again at once.
#[inline(never)]
fn of_bus(job: &mut Job<'_, '_>, bus: Bus) -> Option<BusSettings> {
    job.host.bus(bus).map(|state| state.settings)
}
