//! The slot to which a stored slot is written as a difference. Part of the format: it never changes.
//!
//! These are the values of [`SlotConfig::usual`] when version 1 of the record was made, as numbers: what a stored record
//! means must not change when the usual does. A record of another usual only becomes longer, until a new version of the
//! format takes it up. A setting that comes later has here what it means when it is not set.

use clino_bus::Duration;
use clino_codec::angle::Range;
use clino_gateway::config::Kind;
use clino_gateway::{SlotConfig, Source};

/// The slot that this source is written as the difference to.
pub(crate) const fn base(source: Source) -> SlotConfig {
    let base = SlotConfig { source, ..SlotConfig::OFF };
    let on = SlotConfig { enabled: true, retries: 1, confirm: true, ..base };
    match source.kind() {
        Kind::Off => base,
        Kind::T7 => SlotConfig {
            period: Duration::from_micros(20_000),
            report_every: Duration::from_micros(100_000),
            tolerance: 100,
            max_rate: 180_000,
            ..on
        },
        Kind::Isu => SlotConfig {
            range: Range::Unidirectional,
            period: Duration::from_micros(266_000),
            max_rate: 90_000,
            ..on
        },
        Kind::Pwm => SlotConfig {
            range: Range::Unidirectional,
            retries: 0,
            confirm: false,
            period: Duration::from_micros(33_333),
            tolerance: 560,
            ..on
        },
    }
}
