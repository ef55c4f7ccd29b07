//! Answers for people: short lines, columns that stay where they are.

use core::fmt::{self, Write};

use clino_bus::Micros;
use clino_gateway::json::{bus_name, echo_name, name};
use clino_gateway::{Bus, Reading};

use crate::fields::DECIMALS;
use crate::host::BusState;

/// The head of a table of readings.
pub fn head(out: &mut dyn Write) -> fmt::Result {
    out.write_str("slot  kind  addr      angle  age       status\n")
}

/// A reading.
pub fn row(out: &mut dyn Write, reading: &Reading, now: Micros) -> fmt::Result {
    let (kind, _, address) = name(&reading.source);
    write!(out, "{:>4}  {kind:<4}  ", reading.slot)?;
    match address {
        0 => out.write_str("   -")?,
        address => write!(out, "{address:>4}")?,
    }
    match reading.angle(now) {
        Some(angle) => write!(out, "  {:>9}", angle.text(DECIMALS).as_str())?,
        None => out.write_str("          -")?,
    }
    match reading.age(now) {
        Some(age) => write!(out, "  {:>5} ms", age.as_millis())?,
        None => out.write_str("  never   ")?,
    }
    writeln!(out, "  {}", reading.status(now).name())
}

/// How a bus is set.
pub fn bus(out: &mut dyn Write, bus: Bus, state: &BusState) -> fmt::Result {
    let (name, line) = (bus_name(bus), &state.line);
    writeln!(
        out,
        "{name}: {} bit/s, guard {} us, DE {} us before and {} us after a frame, echo {}",
        line.serial.baud,
        line.guard.0,
        line.pre_delay.0,
        line.post_delay.0,
        echo_name(line.echo)
    )
}

/// What happened on a bus since reset.
pub fn counters(out: &mut dyn Write, bus: Bus, state: &BusState) -> fmt::Result {
    let counters = &state.counters;
    writeln!(out, "{}", bus_name(bus))?;
    let numbers = [
        ("requests", counters.requests),
        ("good", counters.good),
        ("no answer", counters.no_answer),
        ("bad answer", counters.bad_answer),
        ("late", counters.late),
        ("retries", counters.retries),
        ("writes to sensors", counters.writes),
        ("contentions", counters.contention),
        ("line busy", counters.line_busy),
        ("driver forced off", counters.forced),
        ("junk characters", counters.junk),
        ("framing errors", counters.framing),
        ("noise errors", counters.noise),
        ("overruns", counters.overrun),
    ];
    for (what, number) in numbers {
        writeln!(out, "  {what:<18} {number:>10}")?;
    }
    writeln!(out, "  {:<18} {:>10} us", "last response", counters.response_last.0)?;
    writeln!(out, "  {:<18} {:>10} us", "longest response", counters.response_max.0)?;
    writeln!(out, "  {:<18} {:>10} ns", "slowest DE release", state.driver.release_max_ns)
}
