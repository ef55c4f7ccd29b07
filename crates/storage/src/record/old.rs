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
use clino_codec::angle::{Angle, Range};
use clino_codec::{isu, t7};
use clino_gateway::config::{Ask, Direction, Filter, Kind};
use clino_gateway::settings::port::{Parity, PortSettings, StopBits};
use clino_gateway::settings::{self, Given};
use clino_gateway::{Bus, BusChange, BusSettings, PwmInput, SlotConfig, Source};

use super::Reject;
use super::base::base;
use super::bytes::Reader;

mod bit {
    pub const ENABLED: u16 = 1;
    pub const ASK: u16 = 1 << 1;
    pub const CONFIRM: u16 = 1 << 2;
    pub const DIRECTION: u16 = 1 << 3;
    pub const RANGE: u16 = 1 << 4;
    pub const RETRIES: u16 = 1 << 5;
    pub const FILTER: u16 = 1 << 6;
    pub const PARTNER: u16 = 1 << 7;
    pub const TOLERANCE: u16 = 1 << 8;
    pub const PERIOD: u16 = 1 << 9;
    pub const TIMEOUT: u16 = 1 << 10;
    pub const STALE_AFTER: u16 = 1 << 11;
    pub const REPORT_EVERY: u16 = 1 << 12;
    pub const SOFT_ZERO: u16 = 1 << 13;
    pub const MAX_RATE: u16 = 1 << 14;
    /// All there are.
    pub const ALL: u16 = (1 << 15) - 1;
}

/// Waits of a bus that follow from its bit rate: latencies to the longest wait for silence.
const WAITS: usize = 9;

const ECHO: [u8; 3] = [0, 1, 2];
const PARITY: [Parity; 3] = [Parity::None, Parity::Even, Parity::Odd];
const STOP_BITS: [StopBits; 2] = [StopBits::One, StopBits::Two];

/// A bus.
pub(crate) fn bus(bus: Bus, reader: &mut Reader<'_>) -> Result<BusSettings, Reject> {
    use settings::bus::id;
    let baud = reader.number("bit rate")?;
    let guard = reader.number("wait_us")?;
    for _ in 0..WAITS {
        reader.number("wait_us")?;
    }
    // The line has bit rate and guard of its own, which are the same.
    reader.number("bit rate")?;
    reader.number("wait_us")?;
    let (pre, post) = (reader.number("wait_us")?, reader.number("wait_us")?);
    let echo = reader.choice("echo", &ECHO)?;
    let longest = |id: u8| {
        let setting = settings::bus::settings(bus).iter().find(|setting| setting.id == id);
        setting.map_or(0, |setting| setting.form.limits().1)
    };
    let named = |setting: u8| {
        let value = match setting {
            id::BAUD => baud.into(),
            id::GUARD => guard.into(),
            id::PRE => pre.into(),
            id::POST => i64::from(post).min(longest(id::POST)),
            id::ECHO => echo.into(),
            _ => return None,
        };
        Some(Given::exactly(value))
    };
    let change = BusChange::named(bus, &named).map_err(Reject::Refused)?;
    Ok(BusSettings::first(bus).with(bus, &change))
}

/// The Modbus port.
pub(crate) fn port(reader: &mut Reader<'_>) -> Result<PortSettings, Reject> {
    Ok(PortSettings {
        address: reader.byte()?,
        baud: reader.number("bit rate")?,
        parity: reader.choice("parity", &PARITY)?,
        stop_bits: reader.choice("stop bits", &STOP_BITS)?,
        ..PortSettings::DEFAULT
    })
}

/// Makes of a slot what the gateway allows.
fn allowed(mut config: SlotConfig, stored_stale: bool) -> SlotConfig {
    let largest = |id: u8| settings::slot::setting(id).map_or(0, |setting| setting.form.limits().1);
    if config.timeout < settings::slot::latency(config.source.kind()) {
        config.timeout = Duration::ZERO;
    }
    if i64::from(config.max_rate) > largest(settings::slot::id::RATE) {
        config.max_rate = 0;
    }
    config.soft_zero = Angle::from_udeg(config.soft_zero.udeg().checked_rem(TURN).unwrap_or(0));
    let stale = core::mem::replace(&mut config.stale, Duration::ZERO);
    let fits = |limit: Duration| {
        settings::slot::check(&SlotConfig { stale: limit, ..config }).is_ok() && limit != config.stale_after()
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
pub(crate) fn slot(reader: &mut Reader<'_>) -> Result<SlotConfig, Reject> {
    let mut config = base(decode_source(reader)?);
    let bits = reader.short("difference")?;
    if bits & !bit::ALL != 0 {
        return Err(Reject::Number { what: "difference" });
    }
    let has = |bit| bits & bit != 0;
    config.enabled ^= has(bit::ENABLED);
    config.confirm ^= has(bit::CONFIRM);
    if has(bit::ASK) {
        config.ask = match config.ask {
            Ask::Angle => Ask::Everything,
            Ask::Everything => Ask::Angle,
        };
    }
    if has(bit::DIRECTION) {
        config.direction = match config.direction {
            Direction::Normal => Direction::Reversed,
            Direction::Reversed => Direction::Normal,
        };
    }
    if has(bit::RANGE) {
        config.range = match config.range {
            Range::Bidirectional => Range::Unidirectional,
            Range::Unidirectional => Range::Bidirectional,
        };
    }
    if has(bit::RETRIES) {
        config.retries = reader.byte()?;
    }
    if has(bit::FILTER) {
        (config.filter, config.samples) = decode_filter(reader)?;
    }
    if has(bit::PARTNER) {
        config.partner = reader.byte()?.checked_sub(1);
    }
    if has(bit::TOLERANCE) {
        let tolerance = reader.short("tolerance")?;
        let parts = if config.source.kind() == Kind::Pwm { PWM_PARTS } else { 1 };
        config.tolerance = tolerance.saturating_mul(parts);
    }
    let spans = [
        (bit::PERIOD, &mut config.period),
        (bit::TIMEOUT, &mut config.timeout),
        (bit::STALE_AFTER, &mut config.stale),
        (bit::REPORT_EVERY, &mut config.report_every),
    ];
    for (_, span) in spans.into_iter().filter(|(bit, _)| has(*bit)) {
        *span = Duration::from_micros(reader.number("span_us")?);
    }
    if has(bit::SOFT_ZERO) {
        config.soft_zero = Angle::from_udeg(reader.signed("soft zero")?);
    }
    if has(bit::MAX_RATE) {
        config.max_rate = reader.number("rate")?;
    }
    Ok(allowed(config, has(bit::STALE_AFTER)))
}

fn decode_source(reader: &mut Reader<'_>) -> Result<Source, Reject> {
    Ok(match reader.byte()? {
        0 => Source::Off,
        1 => {
            let code = reader.byte()?;
            let address = t7::Address::of_request(code).ok_or(Reject::Code { what: "T7 address", code })?;
            Source::T7 { address, axis: reader.choice("axis", &t7::Axis::ALL)? }
        }
        2 => {
            let code = reader.byte()?;
            let address = isu::Address::new(code).ok_or(Reject::Code { what: "ISU address", code })?;
            Source::Isu { address }
        }
        3 => Source::Pwm { input: reader.choice("PWM input", &[PwmInput::Pwm1, PwmInput::Pwm2])? },
        code => return Err(Reject::Code { what: "source", code }),
    })
}

fn decode_filter(reader: &mut Reader<'_>) -> Result<(Filter, u8), Reject> {
    let (code, samples) = (reader.byte()?, reader.byte()?);
    match code {
        0 => Ok((Filter::Off, 1)),
        1 => Ok((Filter::Mean, samples)),
        2 => Ok((Filter::Median, samples)),
        code => Err(Reject::Code { what: "filter", code }),
    }
}
