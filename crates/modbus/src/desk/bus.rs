//! A bus in the gateway's terms and in those of the map.

use clino_bus::{Micros, Serial, Timing, line};
use clino_gateway::{Bus, BusSettings};

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

/// The bus that the map is to tell as `wanted`. Another bit rate brings its usual waits with it, but for what is changed
/// beside it.
pub fn changed(bus: Bus, now: &BusSettings, wanted: &BusConfig) -> BusSettings {
    let before = shown(now);
    let serial = Serial { baud: wanted.baud };
    let mut timing = match (wanted.baud == before.baud, bus) {
        (true, _) => now.timing,
        (false, Bus::T7) => Timing::t7(serial),
        (false, Bus::Isu) => Timing { serial, ..Timing::isu() },
    };
    if wanted.guard_us != before.guard_us {
        timing.guard = Micros(wanted.guard_us.into());
    }
    let line = line::Settings {
        pre_delay: Micros(wanted.pre_delay_us.into()),
        post_delay: Micros(wanted.post_delay_us.into()),
        echo: wanted.echo,
        ..timing.line()
    };
    BusSettings { timing, line }
}
