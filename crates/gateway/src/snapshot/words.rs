//! A reading as 32-bit words, so that each can be read and written at once. Any words make a reading: a reader may see
//! the words of two readings, and then detects that.
//!
//! ```text
//!  0  status | flags << 8 | health << 16 | address << 24      6  temperature | alarms << 16
//!  1  sequence                                             7, 8  time of the last good value, low half first
//!  2  angle of the sensor, µ°                                 9  stale after, µs
//!  3  angle, 0.001°                                           10  period, µs
//!  4  rate, 0.001°/s                                         11  reported every, µs
//!  5  turns
//! ```

use core::sync::atomic::{AtomicU32, Ordering};

use clino_bus::{Duration, Instant};
use clino_codec::angle::Angle;
use clino_codec::t7;

use crate::alarm::Alarms;
use crate::config::{Kind, Source};
use crate::health::Health;
use crate::snapshot::Value;
use crate::summary::Standing;
use crate::{Published, Reading, ReadingBrief, Status};

pub(super) const WORDS: usize = 12;

const FRESH: u8 = 1 << 0;
const ENABLED: u8 = 1 << 1;
const WARM: u8 = 1 << 2;
const MEASURED: u8 = 1 << 3;
/// Two bits each.
const KIND: u8 = 4;
const PART: u8 = 6;
const TWO_BITS: u8 = 0b11;
/// In place of an axis.
const INCOMPLETE: u8 = 3;
/// Where the alarms are in the word of the temperature.
const ALARMS: u32 = 16;

pub(super) fn words(reading: &Reading) -> [u32; WORDS] {
    let source = reading.source;
    let part = match source {
        Source::T7 { axis, .. } => axis.get(),
        Source::Incomplete { .. } => INCOMPLETE,
        Source::Off | Source::Isu { .. } | Source::Pwm { .. } => 0,
    };
    let flag = |bit, on: bool| if on { bit } else { 0 };
    let flags = flag(FRESH, reading.fresh)
        | flag(ENABLED, reading.enabled)
        | flag(WARM, reading.temperature.is_some())
        | flag(MEASURED, reading.measured.is_some())
        | (source.kind() as u8) << KIND
        | part << PART;
    let measured = reading.measured.unwrap_or(Instant::ZERO).as_micros();
    [
        u32::from_le_bytes([reading.status as u8, flags, reading.health.bits(), source.address()]),
        reading.sequence,
        reading.raw.udeg().cast_unsigned(),
        reading.angle.mdeg().cast_unsigned(),
        reading.rate.cast_unsigned(),
        reading.turns.cast_unsigned(),
        u32::from(reading.temperature.unwrap_or(0).cast_unsigned())
            | u32::from(reading.alarms.bits()) << ALARMS,
        measured as u32,
        (measured >> u32::BITS) as u32,
        reading.stale_after.as_micros(),
        reading.period.as_micros(),
        reading.report_every.as_micros(),
    ]
}

pub(super) fn reading(slot: u8, words: &[u32; WORDS]) -> Reading {
    let [first, sequence, raw, angle, rate, turns, temperature, low, high, stale, period, report] = *words;
    let [status, flags, health, address] = first.to_le_bytes();
    let has = |flag| flags & flag != 0;
    let measured = Instant::from_micros(u64::from(high) << u32::BITS | u64::from(low));
    Reading {
        alarms: alarms(temperature),
        slot,
        source: source(flags >> KIND & TWO_BITS, flags >> PART & TWO_BITS, address),
        enabled: has(ENABLED),
        sequence,
        health: Health::from_bits(health),
        fresh: has(FRESH),
        status: Status::ALL.get(usize::from(status)).copied().unwrap_or_default(),
        raw: Angle::from_udeg(raw.cast_signed()),
        angle: Published::from_mdeg(angle.cast_signed()),
        rate: rate.cast_signed(),
        turns: turns.cast_signed(),
        temperature: has(WARM).then_some((temperature as u16).cast_signed()),
        measured: has(MEASURED).then_some(measured),
        stale_after: Duration::from_micros(stale),
        period: Duration::from_micros(period),
        report_every: Duration::from_micros(report),
    }
}

pub(super) fn value(words: &[AtomicU32; WORDS], now: Instant) -> Value {
    let [_, _, _, angle, ..] = words;
    let (status, age_ms) = worth(words, now);
    let angle = (status == Status::Ok).then(|| Published::from_mdeg(load(angle).cast_signed()));
    Value { status, angle, age_ms }
}

pub(super) fn standing(words: &[AtomicU32; WORDS], now: Instant) -> Standing {
    let [first, _, _, _, _, _, sixth, ..] = words;
    let [_, flags, health, address] = load(first).to_le_bytes();
    let (status, age_ms) = worth(words, now);
    let source = source(flags >> KIND & TWO_BITS, flags >> PART & TWO_BITS, address);
    Standing { source, status, health: Health::from_bits(health), alarms: alarms(load(sixth)), age_ms }
}

pub(super) fn brief(words: &[AtomicU32; WORDS], now: Instant) -> ReadingBrief {
    let [_, sequence, _, _, _, _, sixth, _, _, _, period, report] = words;
    ReadingBrief {
        status: worth(words, now).0,
        sequence: load(sequence),
        alarms: alarms(load(sixth)),
        period: Duration::from_micros(load(period)),
        report_every: Duration::from_micros(load(report)),
    }
}

/// Status and age at `now`, in milliseconds.
fn worth(words: &[AtomicU32; WORDS], now: Instant) -> (Status, Option<u64>) {
    let [first, _, _, _, _, _, _, low, high, stale, ..] = words;
    let [status, flags, ..] = load(first).to_le_bytes();
    let status = Status::ALL.get(usize::from(status)).copied().unwrap_or_default();
    let measured = (flags & MEASURED != 0)
        .then(|| Instant::from_micros(u64::from(load(high)) << u32::BITS | u64::from(load(low))));
    let status = match (status, measured) {
        (Status::Ok, Some(at)) if now <= at + Duration::from_micros(load(stale)) => Status::Ok,
        (Status::Ok, _) => Status::Stale,
        (other, _) => other,
    };
    (status, measured.map(|at| now.millis_since(at)))
}

/// The state of the alarms, in the word of the temperature.
fn alarms(word: u32) -> Alarms {
    Alarms::from_bits((word >> ALARMS) as u8)
}

fn load(word: &AtomicU32) -> u32 {
    word.load(Ordering::Relaxed)
}

fn source(kind: u8, part: u8, address: u8) -> Source {
    let kind = Kind::from_code(kind).unwrap_or_default();
    match t7::Axis::new(part) {
        Some(axis) => Source::of(kind, address, axis),
        None => Source::Incomplete { kind, address },
    }
}
