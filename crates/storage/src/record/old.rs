//! Formats 1 and 2 of the record. Every later version reads them.
//!
//! Numbers are LEB128: seven bits a byte, the lowest first, the top bit says that more follow; signed ones zigzag. Spans
//! are in microseconds, angles in micro-degrees.
//!
//! *A bus*: bit rate, guard, latencies of a reading and of a writing request, margin, gap, quiet, patience, late, extension,
//! longest wait for silence; then of the line: bit rate, guard, delays before and after a frame; 0, 1, 2 for echo off,
//! expected, detect. What follows from the bit rate is read over.
//!
//! *The Modbus port*, since version 2: address, bit rate, parity (0 none, 1 even, 2 odd), stop bits less one.
//!
//! *A slot*: its source, and what is different from the slot of `record/base.rs` with that source.
//!
//! ```text
//! ┌────────┬────────────────────┬────────────┬───────────────────────┐
//! │ source │ address and axis   │ difference │ what is different     │
//! │        │ (T7), address      │ LEB128     │ in the order of bits  │
//! │        │ (ISU), input (PWM) │            │                       │
//! └────────┴────────────────────┴────────────┴───────────────────────┘
//! ```
//!
//! Source: 0 off, 1 T7, 2 ISU, 3 PWM. Bits 0 to 4 of the difference have no bytes to follow: what has two values is then
//! the other one.
//!
//! | bit | | follows |
//! |---|---|---|
//! | 0 | enabled | |
//! | 1 | asked for | |
//! | 2 | confirmed | |
//! | 3 | direction | |
//! | 4 | range | |
//! | 5 | retries | byte |
//! | 6 | filter | byte (0 off, 1 mean, 2 median), byte: samples |
//! | 7 | partner | byte: slot and 1, 0 for none |
//! | 8 | tolerance | number; of a PWM in 0.01° |
//! | 9 to 12 | period, timeout, stale after, report every | number, µs |
//! | 13 | soft zero | signed number, µ° |
//! | 14 | greatest rate | number, 0.001°/s |
//!
//! What these versions allowed and the gateway does not any more becomes what comes next to it: a stale limit that does not
//! fit its period follows it, a timeout below the sensor's latency is the document's, a rate beyond all is no limit, a
//! driver that was on too long is on as long as it may be.

use clino_bus::Duration;
use clino_codec::angle::Angle;
use clino_codec::t7::Axis;
use clino_gateway::config::{Filter, Kind, SINGLE_AXIS};
use clino_gateway::settings::port::{self, PortSettings};
use clino_gateway::settings::slot::{self, id};
use clino_gateway::settings::{self, Settable, Shown, Tabled};
use clino_gateway::{Bus, BusSettings, SlotConfig, Source};

use super::Reject;
use super::base::base;
use super::bytes::Reader;

/// How the value of a difference is written.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Form {
    /// Not at all: of two values it has the other one.
    Switch,
    Byte,
    /// A byte, and another one: the samples.
    Filter,
    /// A byte, one more than the value.
    Partner,
    /// A number of 16 bits; of a PWM a tenth of the value.
    Tolerance,
    Number,
    Signed,
}

/// What the bits of the difference are, the lowest first.
const BITS: [(u8, Form); 15] = [
    (id::ENABLED, Form::Switch),
    (id::ASK, Form::Switch),
    (id::CONFIRM, Form::Switch),
    (id::DIRECTION, Form::Switch),
    (id::RANGE, Form::Switch),
    (id::RETRIES, Form::Byte),
    (id::FILTER, Form::Filter),
    (id::PARTNER, Form::Partner),
    (id::TOLERANCE, Form::Tolerance),
    (id::PERIOD, Form::Number),
    (id::TIMEOUT, Form::Number),
    (id::STALE, Form::Number),
    (id::REPORT, Form::Number),
    (id::ZERO, Form::Signed),
    (id::RATE, Form::Number),
];

/// Waits of a bus that follow from its bit rate: latencies to the longest wait for silence.
const WAITS: usize = 9;

/// Sets what is within the limits of today.
#[inline(never)]
fn put(reader: &mut Reader<'_>, of: &mut dyn Settable, id: u8, value: i64) -> Option<()> {
    let shown: &dyn Shown = of;
    let (place, definition) = shown.find(id)?;
    reader.accepted(definition.check(value))?;
    of.set(place, value);
    Some(())
}

/// A bus.
#[inline(never)]
pub(crate) fn bus(bus: Bus, reader: &mut Reader<'_>) -> Option<BusSettings> {
    use settings::bus::id;
    let mut settings = BusSettings::first(bus);
    let of = &mut Tabled::new(settings::bus::settings(bus), &mut settings);
    let value = reader.number("bit rate")?.into();
    put(reader, of, id::BAUD, value)?;
    let value = reader.number("wait_us")?.into();
    put(reader, of, id::GUARD, value)?;
    // Then the waits; the line has bit rate and guard of its own, which are the same.
    for _ in 0..WAITS.saturating_add(2) {
        reader.number("wait_us")?;
    }
    let value = reader.number("wait_us")?.into();
    put(reader, of, id::PRE, value)?;
    let shown: &dyn Shown = of;
    let longest = shown.find(id::POST).map_or(0, |(_, definition)| definition.form.limits().1);
    let value = i64::from(reader.number("wait_us")?).min(longest);
    put(reader, of, id::POST, value)?;
    let value = reader.byte()?.into();
    put(reader, of, id::ECHO, value)?;
    Some(settings)
}

/// The Modbus port.
#[inline(never)]
pub(crate) fn port(reader: &mut Reader<'_>) -> Option<PortSettings> {
    let mut settings = PortSettings::DEFAULT;
    let of = &mut Tabled::new(&port::SETTINGS, &mut settings);
    let value = reader.byte()?.into();
    put(reader, of, port::id::ADDRESS, value)?;
    let value = reader.number("bit rate")?.into();
    put(reader, of, port::id::BAUD, value)?;
    let value = reader.byte()?.into();
    put(reader, of, port::id::PARITY, value)?;
    let value = i64::from(reader.byte()?).saturating_add(1);
    put(reader, of, port::id::STOP_BITS, value)?;
    Some(settings)
}

/// Makes of a slot what the gateway allows.
fn allowed(mut config: SlotConfig, stored_stale: bool) -> SlotConfig {
    let largest = |id: u8| slot::setting(id).map_or(0, |setting| setting.form.limits().1);
    if config.timeout < slot::latency(config.source.kind()) {
        config.timeout = Duration::ZERO;
    }
    if i64::from(config.max_rate) > largest(id::RATE) {
        config.max_rate = 0;
    }
    config.soft_zero = Angle::from_udeg(config.soft_zero.udeg().checked_rem(TURN).unwrap_or(0));
    let stale = core::mem::replace(&mut config.stale, Duration::ZERO);
    let fits = |limit: Duration| {
        slot::check(&SlotConfig { stale: limit, ..config }).is_ok() && limit != config.stale_after()
    };
    if stored_stale && fits(stale) {
        config.stale = stale;
    }
    config
}

/// Micro-degrees of a turn.
const TURN: i32 = 360_000_000;
/// Parts of the tolerance of a PWM now, of one then.
const PWM_PARTS: u16 = 10;

/// A slot.
#[inline(never)]
pub(crate) fn slot(reader: &mut Reader<'_>) -> Option<SlotConfig> {
    let mut config = base(source(reader)?);
    let is_pwm = config.source.kind() == Kind::Pwm;
    let mut bits = reader.short("difference")?;
    let mut stored_stale = false;
    for &(id, form) in &BITS {
        let is_different = bits & 1 != 0;
        bits >>= 1;
        if !is_different {
            continue;
        }
        stored_stale |= id == id::STALE;
        let Some(setting) = slot::setting(id) else { continue };
        let value = match form {
            Form::Switch => i64::from((setting.get)(&config) == 0),
            Form::Byte | Form::Filter => reader.byte()?.into(),
            Form::Partner => i64::from(reader.byte()?).saturating_sub(1),
            Form::Tolerance => {
                let parts = if is_pwm { PWM_PARTS } else { 1 };
                reader.short("tolerance")?.saturating_mul(parts).into()
            }
            Form::Number => reader.number(setting.name)?.into(),
            Form::Signed => reader.signed(setting.name)?.into(),
        };
        if form == Form::Filter {
            reader.accepted(setting.check(value))?;
            let samples = reader.byte()?;
            config.samples = if value == Filter::Off as i64 { 1 } else { samples };
        }
        // Other values are made what the gateway allows, or refused with the whole slot.
        (setting.set)(&mut config, value);
    }
    if bits != 0 {
        return reader.refuse(Reject::Number { what: "difference" });
    }
    Some(allowed(config, stored_stale))
}

/// The codes of the kinds are still the same.
fn source(reader: &mut Reader<'_>) -> Option<Source> {
    let code = reader.byte()?;
    let Some(kind) = Kind::from_code(code) else { return reader.refuse(Reject::Code { what: "source", code }) };
    if kind == Kind::Off {
        return Some(Source::Off);
    }
    let code = reader.byte()?;
    let axis = if kind == Kind::T7 { Axis::new(reader.byte()?) } else { Some(SINGLE_AXIS) };
    // Inputs were counted from 0.
    let address = if kind == Kind::Pwm { code.saturating_add(1) } else { code };
    match axis.map(|axis| Source::of(kind, address, axis)) {
        None | Some(Source::Incomplete { .. }) => reader.refuse(Reject::Code { what: "address", code }),
        source => source,
    }
}
