//! A slot in the gateway's terms and in those of the map.

use clino_codec::angle::{Angle, Range};
use clino_codec::{isu, t7};
use clino_gateway::config::{Direction, Filter};
use clino_gateway::{PwmInput, SlotConfig, Source, Span};

use crate::config;
use crate::host::Kind;
use crate::status::Status;

/// Microseconds of a millisecond.
const MS: u32 = 1_000;

/// A status as the map tells it. The gateway's numbers are its own.
pub fn status(status: clino_gateway::Status) -> Status {
    use clino_gateway::Status as Core;
    match status {
        Core::Disabled => Status::Disabled,
        Core::NeverRead => Status::NeverRead,
        Core::Ok => Status::Ok,
        Core::Stale => Status::Stale,
        Core::NoAnswer => Status::NoAnswer,
        Core::BadAnswer => Status::BadAnswer,
        Core::DeviceError => Status::DeviceError,
        Core::OutOfRange => Status::OutOfRange,
        Core::NotSent => Status::NotSent,
        Core::Suspect => Status::Suspect,
        Core::NoSignal => Status::NoSignal,
        Core::StuckLow => Status::StuckLow,
        Core::StuckHigh => Status::StuckHigh,
        Core::BadPeriod => Status::BadPeriod,
    }
}

/// Kind, address and axis of a source.
pub fn place(source: Source) -> (Kind, u8, u8) {
    match source {
        Source::Off => (Kind::None, 0, 0),
        Source::T7 { address, axis } => (Kind::T7, address.get(), axis.get()),
        Source::Isu { address } => (Kind::Isu, address.get(), 0),
        Source::Pwm { input: PwmInput::Pwm1 } => (Kind::Pwm, 1, 0),
        Source::Pwm { input: PwmInput::Pwm2 } => (Kind::Pwm, 2, 0),
    }
}

fn source(kind: Kind, address: u8, axis: u8) -> Option<Source> {
    Some(match kind {
        Kind::None => Source::Off,
        Kind::T7 => Source::T7 { address: t7::Address::new(address)?, axis: t7::Axis::new(axis)? },
        Kind::Isu => Source::Isu { address: isu::Address::new(address)? },
        Kind::Pwm => match address {
            1 => Source::Pwm { input: PwmInput::Pwm1 },
            2 => Source::Pwm { input: PwmInput::Pwm2 },
            _ => return None,
        },
    })
}

/// A configuration as the map tells it: times in whole milliseconds, angles in whole millidegrees.
pub fn shown(config: &SlotConfig) -> config::SlotConfig {
    let (kind, address, axis) = place(config.source);
    let ms = |span: Span| span.as_micros() / MS;
    config::SlotConfig {
        enabled: config.enabled,
        kind,
        address,
        axis,
        period_ms: ms(config.period),
        stale_ms: ms(config.stale_after),
        timeout_ms: ms(config.timeout) as u16,
        retries: config.retries,
        zero_mdeg: config.soft_zero.mdeg(),
        reversed: config.direction == Direction::Reversed,
        unidirectional: config.range == Range::Unidirectional,
        filter: match config.filter {
            Filter::Off => config::Filter::None,
            Filter::Mean(_) => config::Filter::Mean,
            Filter::Median(_) => config::Filter::Median,
        },
        filter_length: config.filter.samples(),
        confirm: config.confirm,
        jump_mdeg_s: config.max_rate,
    }
}

/// The configuration that the map is to tell as `wanted`; `None` if there is no such sensor.
///
/// What is not changed stays as it is, finer than the map can tell it. In a slot that reads another kind of sensor from now
/// on, it becomes what is usual for that kind.
pub fn changed(now: &SlotConfig, wanted: &config::SlotConfig) -> Option<SlotConfig> {
    let before = shown(now);
    let source = source(wanted.kind, wanted.address, wanted.axis)?;
    let mut config = match before.kind == wanted.kind {
        true => SlotConfig { source, ..*now },
        false => SlotConfig::usual(source),
    };
    if wanted.enabled != before.enabled {
        config.enabled = wanted.enabled;
    }
    if wanted.period_ms != before.period_ms {
        config.period = Span::from_millis(wanted.period_ms);
    }
    if wanted.stale_ms != before.stale_ms {
        config.stale_after = Span::from_millis(wanted.stale_ms);
    }
    if wanted.timeout_ms != before.timeout_ms {
        config.timeout = Span::from_millis(wanted.timeout_ms.into());
    }
    if wanted.retries != before.retries {
        config.retries = wanted.retries;
    }
    if wanted.zero_mdeg != before.zero_mdeg {
        config.soft_zero = Angle::from_mdeg(wanted.zero_mdeg)?;
    }
    if wanted.reversed != before.reversed {
        config.direction = if wanted.reversed { Direction::Reversed } else { Direction::Normal };
    }
    if wanted.unidirectional != before.unidirectional {
        config.range = if wanted.unidirectional { Range::Unidirectional } else { Range::Bidirectional };
    }
    if (wanted.filter, wanted.filter_length) != (before.filter, before.filter_length) {
        config.filter = match wanted.filter {
            config::Filter::None => Filter::Off,
            config::Filter::Mean => Filter::Mean(wanted.filter_length),
            config::Filter::Median => Filter::Median(wanted.filter_length),
        };
    }
    if wanted.confirm != before.confirm {
        config.confirm = wanted.confirm;
    }
    if wanted.jump_mdeg_s != before.jump_mdeg_s {
        config.max_rate = wanted.jump_mdeg_s;
    }
    Some(config)
}
