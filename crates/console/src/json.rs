//! One JSON object per line, fixed keys, `null` where there is no number.
//!
//! ```text
//! {"slot":0,"kind":"t7","bus":"t7","address":1,"status":"ok","angle_deg":12.345,"age_ms":3,"health":[],"seq":152}
//! {"stats":"t7","requests":152,"good":152,"no_answer":0,"bad_answer":0,"late":0}
//! {"line":"t7","forced":0,"busy":0,"junk":0,"framing":0,"noise":0,"overrun":0}
//! {"times":"t7","response_us":2083,"response_max_us":2083,"de_release_max_ns":1279,"de_high_max_us":261}
//! {"bus_fault":"t7","fault":null,"faults":0,"in_vain":0}
//! {"alarm":0,"name":"high","state":"active","age_ms":20,"extreme":12.345,"unit":"deg","angle_deg":12.340}
//! ```
//!
//! `angle_deg` is in degrees with three decimals and is a number only while `status` is `ok`; `age_ms` is the
//! time since the last good value of that slot was received, whatever the status is now; `health` holds the
//! names of the signals that the slot gives, such as `noisy`; `seq` counts the outcomes of the slot, good or bad, so that one
//! that was missed shows. `fault` is the name of a
//! [`BusFault`] while the bus is out of order.

use core::fmt::{self, Write};

use clino_bus::{BusCounters, DriverEnable, Instant};
use clino_gateway::config::{Bus, Kind, PwmInput, Source};
use clino_gateway::{Alarm, AlarmDetail, AlarmState, BusFault, BusHealth, Reading};

/// Longest line of the stream, line end (CR LF on the wire) included: the summary with every signal. A reading with every
/// signal and the highest age has 168 characters.
pub const MAX_LINE: usize = 216;

/// Writes a reading as it stands at `now`.
pub fn reading(out: &mut dyn Write, reading: &Reading, now: Instant) -> fmt::Result {
    let (kind, bus, address) = name(&reading.source);
    write!(
        out,
        "{{\"slot\":{},\"kind\":\"{kind}\",\"bus\":\"{bus}\",\"address\":{address},\"status\":\"{}\",\"angle_deg\":",
        reading.slot,
        reading.status(now).name()
    )?;
    match reading.angle(now) {
        Some(angle) => write!(out, "{angle}")?,
        None => out.write_str("null")?,
    }
    out.write_str(",\"age_ms\":")?;
    match reading.age_ms(now) {
        Some(age_ms) => write!(out, "{age_ms}")?,
        None => out.write_str("null")?,
    }
    out.write_str(",\"health\":[")?;
    for (place, name) in reading.health.names().enumerate() {
        write!(out, "{}\"{name}\"", if place == 0 { "" } else { "," })?;
    }
    writeln!(out, "],\"seq\":{}}}", reading.sequence)
}

/// Writes the state of an alarm of a slot, which reads this. `detail` is `None` while the alarm is quiet.
pub fn alarm(
    out: &mut dyn Write,
    alarm: Alarm,
    detail: Option<AlarmDetail>,
    reading: &Reading,
    now: Instant,
) -> fmt::Result {
    let state = detail.map_or(AlarmState::Quiet, |detail| detail.state).name();
    write!(
        out,
        "{{\"alarm\":{},\"name\":\"{}\",\"state\":\"{state}\",\"age_ms\":",
        reading.slot,
        alarm.name()
    )?;
    match detail {
        Some(AlarmDetail { age_ms, .. }) => write!(out, "{age_ms}")?,
        None => out.write_str("null")?,
    }
    out.write_str(",\"extreme\":")?;
    match detail.and_then(|detail| detail.extreme) {
        Some(extreme) => thousandths(out, extreme)?,
        None => out.write_str("null")?,
    }
    out.write_str(match alarm {
        Alarm::High | Alarm::Low => ",\"unit\":\"deg\"",
        Alarm::Rate => ",\"unit\":\"deg/s\"",
        Alarm::NoValue => ",\"unit\":null",
    })?;
    out.write_str(",\"angle_deg\":")?;
    match reading.angle(now) {
        Some(angle) => write!(out, "{angle}")?,
        None => out.write_str("null")?,
    }
    out.write_str("}\n")
}

/// Writes a number that counts thousandths, with three decimals.
fn thousandths(out: &mut dyn Write, value: i32) -> fmt::Result {
    let (sign, count) = (if value < 0 { "-" } else { "" }, value.unsigned_abs());
    write!(out, "{sign}{}.{:03}", count / 1_000, count % 1_000)
}

/// Which of a bus's statistics lines. Several short lines, so that a reading never waits for a long one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Topic {
    /// How the exchanges ended.
    Exchanges,
    /// What the line was like.
    Line,
    /// How long things took.
    Times,
    /// Whether the bus is out of order.
    Fault,
}

impl Topic {
    /// All topics, in the order in which they are printed.
    pub const ALL: [Topic; 4] = [Topic::Exchanges, Topic::Line, Topic::Times, Topic::Fault];
}

/// Writes one topic of the statistics of a bus.
pub fn statistics(
    out: &mut dyn Write,
    bus: Bus,
    topic: Topic,
    counters: &BusCounters,
    health: &BusHealth,
    driver: &DriverEnable,
) -> fmt::Result {
    let bus = bus.name();
    match topic {
        Topic::Exchanges => writeln!(
            out,
            "{{\"stats\":\"{bus}\",\"requests\":{},\"good\":{},\"no_answer\":{},\"bad_answer\":{},\"late\":{}}}",
            counters.requests, counters.good, counters.no_answer, counters.bad_answer, counters.late,
        ),
        Topic::Line => writeln!(
            out,
            "{{\"line\":\"{bus}\",\"forced\":{},\"busy\":{},\"junk\":{},\"framing\":{},\"noise\":{},\"overrun\":{}}}",
            counters.forced,
            counters.line_busy,
            counters.discarded,
            counters.framing,
            counters.noise,
            counters.overrun,
        ),
        Topic::Times => writeln!(
            out,
            "{{\"times\":\"{bus}\",\"response_us\":{},\"response_max_us\":{},\"de_release_max_ns\":{},\
             \"de_high_max_us\":{}}}",
            counters.response_last.as_micros(),
            counters.response_max.as_micros(),
            driver.release_max_ns,
            driver.high_max_us,
        ),
        Topic::Fault => {
            let quote = if health.fault.is_some() { "\"" } else { "" };
            writeln!(
                out,
                "{{\"bus_fault\":\"{bus}\",\"fault\":{quote}{}{quote},\"faults\":{},\"in_vain\":{}}}",
                health.fault.map_or("null", BusFault::name),
                health.faults,
                health.in_vain,
            )
        }
    }
}

/// Kind, bus and address of what a slot reads.
pub fn name(source: &Source) -> (&'static str, &'static str, u8) {
    match source {
        Source::Off => (Kind::Off.name(), "none", 0),
        Source::Incomplete { kind, address } => (kind.name(), "none", *address),
        Source::T7 { address, .. } => ("t7", Bus::T7.name(), address.get()),
        Source::Isu { address } => ("isu", Bus::Isu.name(), address.get()),
        Source::Pwm { input: PwmInput::Pwm1 } => ("pwm", "pwm1", 0),
        Source::Pwm { input: PwmInput::Pwm2 } => ("pwm", "pwm2", 0),
    }
}
