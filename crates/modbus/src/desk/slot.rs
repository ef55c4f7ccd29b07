//! A slot in the gateway's terms and in those of the map.

use clino_codec::angle::Range;
use clino_gateway::config::{Direction, Filter};
use clino_gateway::settings::Given;
use clino_gateway::settings::slot::id;
use clino_gateway::{SlotConfig, Source, Span};

use crate::config;
use crate::host::Kind;
use crate::status::Status;

/// Microseconds of a millisecond.
const MS: u32 = 1_000;
/// Micro-degrees of a millidegree.
const UDEG: i32 = 1_000;

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
        Core::ConfigFault => Status::ConfigFault,
    }
}

/// Kind and address of a source.
pub fn place(source: Source) -> (Kind, u8) {
    let kind = match source.kind() {
        clino_gateway::config::Kind::Off => Kind::None,
        clino_gateway::config::Kind::T7 => Kind::T7,
        clino_gateway::config::Kind::Isu => Kind::Isu,
        clino_gateway::config::Kind::Pwm => Kind::Pwm,
    };
    (kind, source.address())
}

/// A configuration as the map tells it: times in whole milliseconds, angles in whole millidegrees.
pub fn shown(config: &SlotConfig) -> config::SlotConfig {
    let (kind, address) = place(config.source);
    let ms = |span: Span| span.as_micros() / MS;
    config::SlotConfig {
        enabled: config.enabled,
        kind,
        address,
        axis: config.axis().get(),
        period_ms: ms(config.period),
        stale_ms: ms(config.stale_after()),
        timeout_ms: ms(config.timeout) as u16,
        retries: config.retries,
        zero_mdeg: config.soft_zero.udeg() / UDEG,
        reversed: config.direction == Direction::Reversed,
        unidirectional: config.range == Range::Unidirectional,
        filter: match config.filter {
            Filter::Off => config::Filter::None,
            Filter::Mean => config::Filter::Mean,
            Filter::Median => config::Filter::Median,
        },
        filter_length: config.samples,
        confirm: config.confirm,
        jump_mdeg_s: config.max_rate,
    }
}

/// The configuration that the map is to tell as `wanted`; `None` if there is no such slot.
pub fn changed(now: &SlotConfig, wanted: &config::SlotConfig) -> Option<SlotConfig> {
    let before = shown(now);
    let named = |id: u8| {
        let (is, was, scale): (i64, i64, i64) = match id {
            id::KIND => (wanted.kind as i64, before.kind as i64, 1),
            id::ADDRESS => (wanted.address.into(), before.address.into(), 1),
            id::AXIS => (wanted.axis.into(), before.axis.into(), 1),
            id::ENABLED => (wanted.enabled.into(), before.enabled.into(), 1),
            id::PERIOD => (wanted.period_ms.into(), before.period_ms.into(), MS.into()),
            id::STALE => (wanted.stale_ms.into(), before.stale_ms.into(), MS.into()),
            id::TIMEOUT => (wanted.timeout_ms.into(), before.timeout_ms.into(), MS.into()),
            id::RETRIES => (wanted.retries.into(), before.retries.into(), 1),
            id::ZERO => (wanted.zero_mdeg.into(), before.zero_mdeg.into(), UDEG.into()),
            id::DIRECTION => (wanted.reversed.into(), before.reversed.into(), 1),
            id::RANGE => (wanted.unidirectional.into(), before.unidirectional.into(), 1),
            id::FILTER => (wanted.filter as i64, before.filter as i64, 1),
            id::SAMPLES => (wanted.filter_length.into(), before.filter_length.into(), 1),
            id::CONFIRM => (wanted.confirm.into(), before.confirm.into(), 1),
            id::RATE => (wanted.jump_mdeg_s.into(), before.jump_mdeg_s.into(), 1),
            _ => return None,
        };
        (is != was).then_some(Given { value: is, scale })
    };
    clino_gateway::settings::slot::changed(now, &named).ok()
}
