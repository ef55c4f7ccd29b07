//! The settings of a slot: how each is shown and typed. It is shown with its unit, and typed without.

use clino_bus::Micros;
use clino_codec::angle::Angle;
use clino_gateway::config::Filter;
use clino_gateway::order::{LONGEST_PERIOD, LONGEST_STALE, LONGEST_TIMEOUT, MOST_RETRIES, SHORTEST_STALE};
use clino_gateway::{SlotConfig, Source, json};

use crate::job::{Job, Outcome, Told};
use crate::reply::Reply;
use crate::slots::LAST_SLOT;
use crate::value::Value;
use crate::words::{FilterKind, Words};

/// One setting of a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Field {
    Enabled,
    Ask,
    Period,
    Timeout,
    Retries,
    Stale,
    Report,
    Confirm,
    Filter,
    Zero,
    Direction,
    Range,
    Rate,
    Partner,
    Tolerance,
}

impl Words for Field {
    const NAMES: &'static [&'static str] = &[
        "enabled",
        "ask",
        "period",
        "timeout",
        "retries",
        "stale",
        "report",
        "confirm",
        "filter",
        "zero",
        "direction",
        "range",
        "rate",
        "partner",
        "tolerance",
    ];
    const VALUES: &'static [Self] = &[
        Field::Enabled,
        Field::Ask,
        Field::Period,
        Field::Timeout,
        Field::Retries,
        Field::Stale,
        Field::Report,
        Field::Confirm,
        Field::Filter,
        Field::Zero,
        Field::Direction,
        Field::Range,
        Field::Rate,
        Field::Partner,
        Field::Tolerance,
    ];
}

/// A turn: soft zeros beyond it say nothing new.
const TURN_MDEG: i64 = 360_000;
/// Micro-degrees in a millidegree.
const UDEG_PER_MDEG: i32 = 1_000;
/// Thousandths of a degree in a step of the tolerance of a PWM input.
const PWM_TOLERANCE_STEP: i64 = 10;

/// What is shown: what the slot reads, and the settings.
const SHOWN: &str = "kind address axis enabled ask period_ms timeout_ms retries stale_ms report_ms confirm \
                     filter samples zero_deg direction range rate_deg_s partner tolerance";

/// Shows how a slot is set.
pub fn show(reply: &mut Reply<'_>, slot: u8, config: &SlotConfig) {
    let (kind, _, address) = json::name(&config.source);
    let (address, axis) = match config.source {
        Source::Off => (Value::None, Value::None),
        Source::T7 { axis, .. } => (address.into(), (axis as u8).into()),
        Source::Isu { .. } => (address.into(), Value::None),
        Source::Pwm { input } => ((input as u8).saturating_add(1).into(), Value::None),
    };
    let filter = match config.filter {
        Filter::Off => FilterKind::Off,
        Filter::Mean(_) => FilterKind::Mean,
        Filter::Median(_) => FilterKind::Median,
    };
    let values = [
        kind.into(),
        address,
        axis,
        Value::Flag(config.enabled),
        config.ask.name().into(),
        config.period.into(),
        config.timeout.into(),
        config.retries.into(),
        config.stale_after.into(),
        config.report_every.into(),
        Value::Flag(config.confirm),
        filter.name().into(),
        config.filter.samples().into(),
        config.soft_zero.into(),
        config.direction.name().into(),
        config.range.name().into(),
        Value::Thousandths(config.max_rate.into()),
        config.partner.into(),
        Value::Thousandths(tolerance_step(config).saturating_mul(config.tolerance.into())),
    ];
    reply.list("config", slot.into(), SHOWN, &values);
}

/// The tolerance is in 0.01° for a PWM input and in 0.001 g for others.
const fn tolerance_step(config: &SlotConfig) -> i64 {
    match config.source {
        Source::Pwm { .. } => PWM_TOLERANCE_STEP,
        Source::Off | Source::T7 { .. } | Source::Isu { .. } => 1,
    }
}

impl Field {
    /// Takes the value of this setting from what was typed; the others stay.
    #[inline(never)]
    pub fn set(self, config: &mut SlotConfig, word: &str, job: &mut Job<'_, '_>) -> Outcome {
        match self {
            Field::Enabled => config.enabled = job.meaning(word)?,
            Field::Ask => config.ask = job.meaning(word)?,
            Field::Period => config.period = job.span(word, "period_ms", Micros::ZERO, LONGEST_PERIOD)?,
            Field::Timeout => config.timeout = job.span(word, "timeout_ms", Micros::ZERO, LONGEST_TIMEOUT)?,
            Field::Retries => config.retries = job.byte(word, "retries", 0, MOST_RETRIES)?,
            Field::Stale => config.stale_after = job.span(word, "stale_ms", SHORTEST_STALE, LONGEST_STALE)?,
            Field::Report => {
                config.report_every = job.span(word, "report_ms", Micros::ZERO, LONGEST_STALE)?
            }
            Field::Confirm => config.confirm = job.meaning(word)?,
            Field::Filter => {
                let kind = job.meaning(word)?;
                config.filter = filter(kind, job)?;
            }
            Field::Zero => {
                let mdeg = job.thousandths(word, "zero_deg", -TURN_MDEG, TURN_MDEG)?;
                config.soft_zero = Angle::from_udeg((mdeg as i32).saturating_mul(UDEG_PER_MDEG));
            }
            Field::Direction => config.direction = job.meaning(word)?,
            Field::Range => config.range = job.meaning(word)?,
            Field::Rate => config.max_rate = job.thousandths(word, "rate_deg_s", 0, u32::MAX.into())? as u32,
            Field::Partner if word == "none" => config.partner = None,
            Field::Partner => config.partner = Some(job.byte(word, "partner", 0, LAST_SLOT)?),
            Field::Tolerance => {
                let step = tolerance_step(config);
                let most = step.saturating_mul(u16::MAX.into());
                let tolerance = job.thousandths(word, "tolerance", 0, most)?;
                config.tolerance = tolerance.checked_div(step).unwrap_or(0) as u16;
            }
        }
        Ok(())
    }
}

fn filter(kind: FilterKind, job: &mut Job<'_, '_>) -> Result<Filter, Told> {
    if kind == FilterKind::Off {
        return Ok(Filter::Off);
    }
    let word = job.word("samples")?;
    let samples = job.byte(word, "samples", 1, Filter::MOST)?;
    Ok(if kind == FilterKind::Mean { Filter::Mean(samples) } else { Filter::Median(samples) })
}
