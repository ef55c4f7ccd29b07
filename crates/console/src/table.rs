//! What stands in columns: for people short lines that stay where they are, for programs the gateway's own JSON.

use clino_bus::{BusCounters, DriverEnable, Instant};
use clino_gateway::config::Name;
use clino_gateway::summary::{Summary, count};
use clino_gateway::{Bus, BusFault, Reading, Source};

use crate::host::{BusState, Host};
use crate::json::{self, Topic};
use crate::label::Label;
use crate::reply::Reply;
use crate::value::Value;

/// The head of a table of readings.
pub fn head(reply: &mut Reply<'_>) {
    if reply.is_for_people() {
        reply.say("slot  kind  addr      angle  age       status\n");
    }
}

/// What people call a slot.
pub fn name_of(host: &dyn Host, slot: u8) -> Name {
    host.config(slot.into()).map_or(Name::NONE, |config| config.name)
}

/// A reading, for people with the name of its slot; nothing of an empty slot.
pub fn row(reply: &mut Reply<'_>, reading: &Reading, name: Name, now: Instant) {
    match reading.source {
        Source::Off => {}
        _ if reply.is_for_people() => columns(reply, reading, name, now),
        _ => json::reading(reply, reading, now),
    }
}

#[inline(never)]
fn columns(reply: &mut Reply<'_>, reading: &Reading, name: Name, now: Instant) {
    let (kind, _, address) = json::name(&reading.source);
    let dash = Value::Text("-");
    let (age, age_text) = match reading.age_ms(now) {
        Some(age_ms) => (age_ms.into(), "{3>5} ms"),
        None => ("never".into(), "{3<8}"),
    };
    let values = [
        reading.slot.into(),
        kind.into(),
        if address == 0 { dash } else { address.into() },
        age,
        reading.angle(now).map_or(dash, Value::from),
        reading.status(now).name().into(),
    ];
    reply.print("{0>4}  {1<4}  {2>4}  {4>9}  ", &values);
    reply.print(age_text, &values);
    reply.print("  {5}", &values);
    for name in reading.health.names() {
        reply.print(" {0}", &[name.into()]);
    }
    if name != Name::NONE {
        reply.print("  {0}", &[Value::Quoted(name.as_str())]);
    }
    reply.say("\n");
}

/// How the gateway is doing as a whole; nothing for people while all is well.
pub fn summary(reply: &mut Reply<'_>, summary: &Summary) {
    let Summary { signals, online, enabled, .. } = *summary;
    if !reply.is_for_people() {
        let values = [enabled.into(), count(online).into(), summary.good().into()];
        reply.list("summary enabled online ok", Value::Signals(signals), &values);
    } else if !signals.is_clean() {
        reply.print("signals: {0}\n", &[Value::Signals(signals)]);
    }
}

/// What happened on a bus since reset.
#[inline(never)]
pub fn counters(reply: &mut Reply<'_>, bus: Bus, state: &BusState) {
    let BusState { counters, health, driver, .. } = state;
    if !reply.is_for_people() {
        for topic in Topic::ALL {
            json::statistics(reply, bus, topic, state);
        }
        reply.begin_list("counters", bus.name().into());
        more_counters(reply, counters, driver);
        reply.end_list();
        return;
    }
    reply.begin_list("bus", bus.name().into());
    let names = "requests good no_answer bad_answer late busy forced junk framing noise overrun response_us \
                 response_max_us de_release_max_ns faults in_vain";
    let counts = [
        counters.requests,
        counters.good,
        counters.no_answer,
        counters.bad_answer,
        counters.late,
        counters.line_busy,
        counters.forced,
        counters.discarded,
        counters.framing,
        counters.noise,
        counters.overrun,
        counters.response_last.as_micros(),
        counters.response_max.as_micros(),
        driver.release_max_ns,
        health.faults,
        health.in_vain,
    ];
    reply.counts(names, &counts);
    reply.entry(&Label::plain("fault"), health.fault.map(BusFault::name).into());
    more_counters(reply, counters, driver);
    reply.end_list();
}

/// Counters that the statistics of the stream leave out.
#[inline(never)]
fn more_counters(reply: &mut Reply<'_>, counters: &BusCounters, driver: &DriverEnable) {
    let names = "retries writes first_try checksum length foreign contention unasked breaks echo parity \
                 response_min_us de_high_max_us";
    let counts = [
        counters.retries,
        counters.writes,
        counters.first_try,
        counters.checksum,
        counters.length,
        counters.foreign,
        counters.contention,
        counters.unasked,
        counters.breaks,
        counters.echo,
        counters.parity,
        counters.response_min.as_micros(),
        driver.high_max_us,
    ];
    reply.counts(names, &counts);
}
