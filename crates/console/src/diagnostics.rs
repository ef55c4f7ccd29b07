//! Diagnostics: counters and the last transactions.

use clino_bus::{Duration, Instant};
use clino_gateway::Bus;
use clino_gateway::order::Order;
use clino_gateway::trace::{Entry, TRACED};

use crate::job::{Job, Outcome};
use crate::label::Label;
use crate::reply::Reply;
use crate::slots::LAST_SLOT;
use crate::table;
use crate::value::Value;

/// `counters [SLOT]`, `counters clear`
pub fn counters(job: &mut Job<'_, '_>) -> Outcome {
    if let Some(word) = job.typed.next() {
        if word == "clear" {
            job.end()?;
            return clear(job);
        }
        let slot = job.byte(word, "slot", 0, LAST_SLOT)?;
        job.end()?;
        of_slot(job, slot);
        return Ok(());
    }
    job.end()?;
    of_buses(job);
    Ok(())
}

/// A function of its own: what only looks does not pay for the stack of the order.
#[inline(never)]
fn clear(job: &mut Job<'_, '_>) -> Outcome {
    job.order(Order::ClearCounters)
}

#[inline(never)]
fn of_buses(job: &mut Job<'_, '_>) {
    for bus in Bus::ALL {
        if let Some(state) = &job.host.bus(bus) {
            table::counters(&mut job.reply, bus, state);
        }
    }
    if let Some(counters) = job.host.modbus_counters() {
        let row = "counters messages errors exceptions requests unanswered overruns";
        let values = [
            counters.messages,
            counters.errors,
            counters.exceptions,
            counters.requests,
            counters.unanswered,
            counters.overruns,
        ];
        job.reply.numbers(row, "modbus".into(), &values.map(u32::from));
    }
    let counts = [job.host.lost_characters(), job.presence.damaged, job.presence.own];
    job.reply.numbers("counters lost damaged echoed", "console".into(), &counts);
}

#[inline(never)]
fn of_slot(job: &mut Job<'_, '_>, slot: u8) {
    let Some(counters) = job.host.detail(slot.into()).map(|detail| detail.counters) else { return };
    let names = "requests first_try retries no_answer skipped checksum length foreign garbled refused not_sent \
                 late writes";
    let counts = [
        counters.requests,
        counters.first_try,
        counters.retries,
        counters.no_answer,
        counters.skipped.into(),
        counters.checksum.into(),
        counters.length.into(),
        counters.foreign.into(),
        counters.garbled.into(),
        counters.refused.into(),
        counters.not_sent.into(),
        counters.late.into(),
        counters.writes.into(),
    ];
    job.reply.begin_list("counters", slot.into());
    job.reply.counts(names, &counts);
    // Before the first answer there are no times.
    let is_known = counters.response_min() > Duration::ZERO;
    for (name, time) in [
        ("response_us", counters.response_last()),
        ("response_min_us", counters.response_min()),
        ("response_max_us", counters.response_max()),
    ] {
        job.reply.entry(&Label::plain(name), is_known.then_some(time.as_micros()).into());
    }
    job.reply.end_list();
}

/// `trace [N]`
pub fn trace(job: &mut Job<'_, '_>) -> Outcome {
    let mut most = TRACED as u8;
    if let Some(word) = job.typed.next() {
        most = job.byte(word, "entries", 1, most)?;
    }
    job.end()?;
    last(job, most);
    Ok(())
}

/// The last transactions, at most `most`.
#[inline(never)]
fn last(job: &mut Job<'_, '_>, most: u8) {
    // They go on while they are printed, and a line takes longer than a transaction: all are fetched first.
    let mut entries = [None; TRACED];
    for (age, place) in entries.iter_mut().enumerate().take(most.into()) {
        *place = job.host.trace(age);
    }
    if job.reply.is_for_people() {
        job.reply.say("       at_us  bus  addr  code  took_us  purpose       verdict\n");
    }
    // One that ended between two calls has moved the others on: it makes one of them come twice.
    let (now, mut before) = (job.host.now(), None);
    for entry in entries.iter().flatten() {
        if before != Some(entry) {
            row(&mut job.reply, entry, now);
        }
        before = Some(entry);
    }
}

fn row(reply: &mut Reply<'_>, entry: &Entry, now: Instant) {
    let bus = Value::Text(entry.bus().name());
    let values = [
        entry.at(now).as_micros().into(),
        entry.address().into(),
        entry.command.into(),
        entry.took().as_micros().into(),
        entry.purpose.name().into(),
        entry.verdict.name().into(),
        bus,
    ];
    if reply.is_for_people() {
        reply.print("{0>12}  {6<3}  {1>4}  {2>4}  {3>7}  {4<12}  {5}\n", &values);
    } else {
        reply.list("trace at_us address code took_us purpose verdict", bus, &values);
    }
}
