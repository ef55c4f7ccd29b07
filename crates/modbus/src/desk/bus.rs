//! A bus in the gateway's terms and in those of the map.

use clino_bus::Micros;
use clino_gateway::settings::Given;
use clino_gateway::settings::bus::id;
use clino_gateway::{Bus, BusSettings};

use crate::config::{BusConfig, echo_code};

/// A bus as the map tells it.
pub fn shown(settings: &BusSettings) -> BusConfig {
    let us = |span: Micros| u16::try_from(span.0).unwrap_or(u16::MAX);
    BusConfig {
        baud: settings.timing.serial.baud,
        guard_us: us(settings.timing.guard),
        pre_delay_us: us(settings.line.pre_delay),
        post_delay_us: us(settings.line.post_delay),
        echo: settings.line.echo,
    }
}

/// The bus that the map is to tell as `wanted`; `None` if it cannot be.
pub fn changed(bus: Bus, now: &BusSettings, wanted: &BusConfig) -> Option<BusSettings> {
    let before = shown(now);
    let named = |id: u8| {
        let (is, was): (i64, i64) = match id {
            id::BAUD => (wanted.baud.into(), before.baud.into()),
            id::GUARD => (wanted.guard_us.into(), before.guard_us.into()),
            id::PRE => (wanted.pre_delay_us.into(), before.pre_delay_us.into()),
            id::POST => (wanted.post_delay_us.into(), before.post_delay_us.into()),
            id::ECHO => (echo_code(wanted.echo).into(), echo_code(before.echo).into()),
            _ => return None,
        };
        (is != was).then_some(Given::exactly(is))
    };
    clino_gateway::settings::bus::changed(bus, now, &named).ok()
}
