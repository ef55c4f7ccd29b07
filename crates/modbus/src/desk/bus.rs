//! A bus in the map's terms.

use clino_bus::Micros;
use clino_gateway::BusSettings;

use crate::config::BusConfig;

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
