//! A change of how a bus runs, field by field.
//!
//! Whoever changes one field knows nothing of the others: they may be changing at the same time, by another door or by a
//! task. So an order names the fields that it changes and is merged with the settings in force when it is carried out.
//! An order never repeats settings that its sender has read before.
//!
//! *Guard.* The usual guard is one character, so that it follows the bit rate. A guard that is not the usual one of the
//! present rate was set by hand, and stays at every rate.

use clino_bus::line::EchoMode;
use clino_bus::{Duration, Serial, Timing};

use super::bus::{id, usual};
use super::{BusSettings, Given, Named, bus};
use crate::config::Bus;
use crate::refusal::Refusal;

/// Fields that change; `None` stays as it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BusChange {
    /// Bit rate, bit/s. The usual waits of that rate come with it.
    pub baud: Option<u32>,
    /// Silence before our driver is switched on.
    pub guard: Option<Duration>,
    /// From there to the first start bit.
    pub pre_delay: Option<Duration>,
    /// From the last stop bit until the driver is switched off.
    pub post_delay: Option<Duration>,
    /// Whether our own characters come back.
    pub echo: Option<EchoMode>,
}

impl BusChange {
    /// The fields that are named, by the table of the bus.
    ///
    /// # Errors
    /// A value that its setting does not have.
    pub fn named(bus: Bus, named: Named<'_>) -> Result<BusChange, Refusal> {
        let mut change = BusChange::NONE;
        for setting in bus::settings(bus) {
            let Some(value) = named(setting.id).map(Given::exact) else { continue };
            setting.check(value)?;
            let micros = Some(Duration::from_micros(value as u32));
            match setting.id {
                id::BAUD => change.baud = Some(value as u32),
                id::GUARD => change.guard = micros,
                id::PRE => change.pre_delay = micros,
                id::POST => change.post_delay = micros,
                _ => change.echo = Some(bus::echo_of(value)),
            }
        }
        Ok(change)
    }

    /// No field changes.
    pub const NONE: BusChange =
        BusChange { baud: None, guard: None, pre_delay: None, post_delay: None, echo: None };
}

/// All fields.
impl From<&BusSettings> for BusChange {
    fn from(settings: &BusSettings) -> BusChange {
        BusChange {
            baud: Some(settings.timing.serial.baud),
            guard: Some(settings.timing.guard),
            pre_delay: Some(settings.line.pre_delay),
            post_delay: Some(settings.line.post_delay),
            echo: Some(settings.line.echo),
        }
    }
}

impl BusSettings {
    /// The bus at another bit rate, with the usual waits of that rate. The line, and a guard set by hand, stay.
    #[must_use]
    pub fn at(&self, bus: Bus, serial: Serial) -> BusSettings {
        let mut settings = *self;
        settings.set_rate(bus, serial);
        settings
    }

    /// The same in place.
    #[inline(never)]
    pub(super) fn set_rate(&mut self, bus: Bus, serial: Serial) {
        let Timing { serial: before, guard, .. } = self.timing;
        if serial == before {
            return;
        }
        let by_hand = Some(guard).filter(|&guard| guard != usual(bus, before).guard);
        self.timing = usual(bus, serial);
        self.line.serial = serial;
        self.set_guard(by_hand.unwrap_or(self.timing.guard));
    }

    /// The bus with these fields changed.
    #[must_use]
    pub fn with(&self, bus: Bus, change: &BusChange) -> BusSettings {
        let mut settings = *self;
        if let Some(baud) = change.baud {
            settings.set_rate(bus, Serial { baud });
        }
        let line = &mut settings.line;
        line.pre_delay = change.pre_delay.unwrap_or(line.pre_delay);
        line.post_delay = change.post_delay.unwrap_or(line.post_delay);
        line.echo = change.echo.unwrap_or(line.echo);
        settings.set_guard(change.guard.unwrap_or(settings.timing.guard));
        settings
    }
}
