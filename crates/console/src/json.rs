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

use clino_bus::Instant;
use clino_gateway::config::{Bus, Kind, PwmInput, Source};
use clino_gateway::{Alarm, AlarmDetail, AlarmState, BusFault, Reading};

use crate::host::BusState;
use crate::reply::Reply;
use crate::value::Value;

/// Longest line of the stream, line end (CR LF on the wire) included: the summary with every signal. A reading with every
/// signal and the highest age has 168 characters.
pub const MAX_LINE: usize = 216;

/// Writes a reading as it stands at `now`.
#[inline(never)]
pub fn reading(reply: &mut Reply<'_>, reading: &Reading, now: Instant) {
    let (kind, bus, address) = name(&reading.source);
    let row = "slot kind bus address status angle_deg age_ms health seq";
    let mut list = reply.open_list(row, reading.slot.into());
    list.text(kind);
    list.text(bus);
    list.count(address.into());
    list.text(reading.status(now).name());
    list.next(reading.angle(now).into());
    list.next(reading.age_ms(now).into());
    list.next(Value::Health(reading.health));
    list.count(reading.sequence);
    list.end();
}

/// Writes the state of an alarm of a slot, which reads this. `detail` is `None` while the alarm is quiet.
#[inline(never)]
pub fn alarm(
    reply: &mut Reply<'_>,
    alarm: Alarm,
    detail: Option<AlarmDetail>,
    reading: &Reading,
    now: Instant,
) {
    let unit = match alarm {
        Alarm::High | Alarm::Low => Some("deg"),
        Alarm::Rate => Some("deg/s"),
        Alarm::NoValue => None,
    };
    let row = "alarm name state age_ms extreme unit angle_deg";
    let mut list = reply.open_list(row, reading.slot.into());
    list.text(alarm.name());
    list.text(detail.map_or(AlarmState::Quiet, |detail| detail.state).name());
    list.next(detail.map(|detail| detail.age_ms).into());
    list.next(detail.and_then(|detail| detail.extreme).map_or(Value::None, Value::Thousandths));
    list.next(unit.into());
    list.next(reading.angle(now).into());
    list.end();
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
#[inline(never)]
pub fn statistics(reply: &mut Reply<'_>, bus: Bus, topic: Topic, state: &BusState) {
    let BusState { counters, health, driver, .. } = state;
    let of = bus.name().into();
    match topic {
        Topic::Exchanges => {
            let counts =
                [counters.requests, counters.good, counters.no_answer, counters.bad_answer, counters.late];
            reply.numbers("stats requests good no_answer bad_answer late", of, &counts);
        }
        Topic::Line => {
            let counts = [
                counters.forced,
                counters.line_busy,
                counters.discarded,
                counters.framing,
                counters.noise,
                counters.overrun,
            ];
            reply.numbers("line forced busy junk framing noise overrun", of, &counts);
        }
        Topic::Times => {
            let counts = [
                counters.response_last.as_micros(),
                counters.response_max.as_micros(),
                driver.release_max_ns,
                driver.high_max_us,
            ];
            let row = "times response_us response_max_us de_release_max_ns de_high_max_us";
            reply.numbers(row, of, &counts);
        }
        Topic::Fault => {
            let values =
                [health.fault.map(BusFault::name).into(), health.faults.into(), health.in_vain.into()];
            reply.list("bus_fault fault faults in_vain", of, &values);
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
