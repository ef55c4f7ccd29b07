//! What stands in columns: for people short lines that stay where they are, for programs the gateway's own JSON.

use core::fmt::{self, Write};

use clino_bus::{BusCounters, DriverEnable, Instant};
use clino_gateway::config::Name;
use clino_gateway::summary::Summary;
use clino_gateway::{Bus, BusFault, Reading, Source};

use crate::host::{BusState, Host};
use crate::json::{self, Topic};
use crate::reply::Reply;
use crate::value::{DECIMALS, Label, Value};

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
    _ = if reading.source == Source::Off {
        Ok(())
    } else if reply.is_for_people() {
        columns(reply.out, reading, name, now)
    } else {
        json::reading(reply.out, reading, now)
    };
}

fn columns(out: &mut dyn Write, reading: &Reading, name: Name, now: Instant) -> fmt::Result {
    let (kind, _, address) = json::name(&reading.source);
    write!(out, "{:>4}  {kind:<4}  ", reading.slot)?;
    match address {
        0 => out.write_str("   -")?,
        address => write!(out, "{address:>4}")?,
    }
    match reading.angle(now) {
        Some(angle) => write!(out, "  {:>9}", angle.angle().text(DECIMALS).as_str())?,
        None => out.write_str("          -")?,
    }
    match reading.age_ms(now) {
        Some(age_ms) => write!(out, "  {age_ms:>5} ms")?,
        None => out.write_str("  never   ")?,
    }
    write!(out, "  {}", reading.status(now).name())?;
    reading.health.names().try_for_each(|name| write!(out, " {name}"))?;
    if name != Name::NONE {
        write!(out, "  \"{}\"", name.as_str())?;
    }
    out.write_str("\n")
}

/// How the gateway is doing as a whole; nothing for people while all is well.
pub fn summary(reply: &mut Reply<'_>, summary: &Summary) {
    let Summary { signals, online, enabled, .. } = *summary;
    if !reply.is_for_people() {
        let values = [enabled.into(), online.count_ones().into(), summary.good().into()];
        reply.list("summary", Value::Signals(signals), "enabled online ok", &values);
    } else if !signals.is_clean() {
        _ = writeln!(reply.out, "signals: {}", Value::Signals(signals));
    }
}

/// What happened on a bus since reset.
#[inline(never)]
pub fn counters(reply: &mut Reply<'_>, bus: Bus, state: &BusState) {
    let BusState { counters, health, driver, .. } = state;
    if !reply.is_for_people() {
        for topic in Topic::ALL {
            _ = json::statistics(reply.out, bus, topic, counters, health, driver);
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
    reply.entry(Label::plain("fault"), health.fault.map(BusFault::name).into());
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
