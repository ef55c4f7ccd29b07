//! How a slot is written: its source, and what is different from the slot of `record/base.rs` with that source.
//!
//! ```text
//! ┌────────┬────────────────────┬────────────┬───────────────────────┐
//! │ source │ address and axis   │ difference │ what is different     │
//! │        │ (T7), address      │ LEB128     │ in the order of bits  │
//! │        │ (ISU), input (PWM) │            │                       │
//! └────────┴────────────────────┴────────────┴───────────────────────┘
//! ```
//!
//! Source: 0 off, 1 T7, 2 ISU, 3 PWM. A slot as usual takes two to four bytes: its difference is 0. Bits 0 to 4 of it
//! have no bytes to follow: what has two values is then the other one.
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
//! | 8 | tolerance | number |
//! | 9 to 12 | period, timeout, stale after, report every | number, µs |
//! | 13 | soft zero | signed number, µ° |
//! | 14 | greatest rate | number, 0.001°/s |

use clino_codec::angle::{Angle, Range};
use clino_codec::{isu, t7};
use clino_gateway::config::{Ask, Direction, Filter};
use clino_gateway::{PwmInput, SlotConfig, Source, Span};

use super::Reject;
use super::base::base;
use super::bytes::{LONGEST_NUMBER, LONGEST_SHORT, Reader, Writer};

/// Bytes of the longest slot: source, address, axis; difference; retries, filter, samples, partner; tolerance; four
/// spans, soft zero, rate.
pub(crate) const LONGEST: usize =
    LONGEST_SHORT.saturating_mul(2).saturating_add(LONGEST_NUMBER.saturating_mul(6)).saturating_add(7);

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

/// The bits of what is different.
fn difference(one: &SlotConfig, other: &SlotConfig) -> u16 {
    [
        (bit::ENABLED, one.enabled != other.enabled),
        (bit::ASK, one.ask != other.ask),
        (bit::CONFIRM, one.confirm != other.confirm),
        (bit::DIRECTION, one.direction != other.direction),
        (bit::RANGE, one.range != other.range),
        (bit::RETRIES, one.retries != other.retries),
        (bit::FILTER, one.filter != other.filter),
        (bit::PARTNER, one.partner != other.partner),
        (bit::TOLERANCE, one.tolerance != other.tolerance),
        (bit::PERIOD, one.period != other.period),
        (bit::TIMEOUT, one.timeout != other.timeout),
        (bit::STALE_AFTER, one.stale_after != other.stale_after),
        (bit::REPORT_EVERY, one.report_every != other.report_every),
        (bit::SOFT_ZERO, one.soft_zero != other.soft_zero),
        (bit::MAX_RATE, one.max_rate != other.max_rate),
    ]
    .into_iter()
    .filter_map(|(bit, different)| different.then_some(bit))
    .fold(0, |bits, bit| bits | bit)
}

pub(crate) fn encode(config: &SlotConfig, writer: &mut Writer<'_>) {
    encode_source(&config.source, writer);
    let bits = difference(config, &base(config.source));
    writer.number(bits.into());
    let has = |bit| bits & bit != 0;
    if has(bit::RETRIES) {
        writer.byte(config.retries);
    }
    if has(bit::FILTER) {
        writer.byte(match config.filter {
            Filter::Off => 0,
            Filter::Mean(_) => 1,
            Filter::Median(_) => 2,
        });
        writer.byte(config.filter.samples());
    }
    if has(bit::PARTNER) {
        writer.byte(config.partner.map_or(0, |partner| partner.saturating_add(1)));
    }
    if has(bit::TOLERANCE) {
        writer.number(config.tolerance.into());
    }
    let spans = [
        (bit::PERIOD, config.period),
        (bit::TIMEOUT, config.timeout),
        (bit::STALE_AFTER, config.stale_after),
        (bit::REPORT_EVERY, config.report_every),
    ];
    spans.iter().filter(|(bit, _)| has(*bit)).for_each(|(_, span)| writer.number(span.as_micros()));
    if has(bit::SOFT_ZERO) {
        writer.signed(config.soft_zero.udeg());
    }
    if has(bit::MAX_RATE) {
        writer.number(config.max_rate);
    }
}

pub(crate) fn decode(reader: &mut Reader<'_>) -> Result<SlotConfig, Reject> {
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
        config.filter = decode_filter(reader)?;
    }
    if has(bit::PARTNER) {
        config.partner = reader.byte()?.checked_sub(1);
    }
    if has(bit::TOLERANCE) {
        config.tolerance = reader.short("tolerance")?;
    }
    let spans = [
        (bit::PERIOD, &mut config.period),
        (bit::TIMEOUT, &mut config.timeout),
        (bit::STALE_AFTER, &mut config.stale_after),
        (bit::REPORT_EVERY, &mut config.report_every),
    ];
    for (_, span) in spans.into_iter().filter(|(bit, _)| has(*bit)) {
        *span = Span::from_micros(reader.number("span_us")?);
    }
    if has(bit::SOFT_ZERO) {
        config.soft_zero = Angle::from_udeg(reader.signed("soft zero")?);
    }
    if has(bit::MAX_RATE) {
        config.max_rate = reader.number("rate")?;
    }
    Ok(config)
}

fn encode_source(source: &Source, writer: &mut Writer<'_>) {
    match source {
        Source::Off => writer.byte(0),
        Source::T7 { address, axis } => {
            writer.byte(1);
            writer.byte(address.get());
            writer.byte(*axis as u8);
        }
        Source::Isu { address } => {
            writer.byte(2);
            writer.byte(address.get());
        }
        Source::Pwm { input } => {
            writer.byte(3);
            writer.byte(match input {
                PwmInput::Pwm1 => 0,
                PwmInput::Pwm2 => 1,
            });
        }
    }
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

fn decode_filter(reader: &mut Reader<'_>) -> Result<Filter, Reject> {
    let (code, samples) = (reader.byte()?, reader.byte()?);
    match code {
        0 => Ok(Filter::Off),
        1 => Ok(Filter::Mean(samples)),
        2 => Ok(Filter::Median(samples)),
        code => Err(Reject::Code { what: "filter", code }),
    }
}
