//! How a gateway is made, and set up before it begins.
//!
//! A gateway is 19 KB. It is made idle, for which there is little to write; then it is set up where it stays.

use clino_bus::{Instant, Serial, Timing};
use clino_codec::pwm;

use super::Gateway;
use crate::bits::Bits;
use crate::bus_task::BusTask;
use crate::config::{Bus, MAX_SLOTS, SlotConfig};
use crate::degraded::DegradedMode;
use crate::pwm::PwmInputs;
use crate::schedule::Polled;
use crate::settings::console::ConsoleSettings;
use crate::settings::{BusSettings, Configuration, Settings};
use crate::trace::Trace;

impl Gateway {
    /// A gateway without slots, for buses as the sensors' documents say. Inlined, so that most of it is made in its
    /// place and not on the stack.
    #[inline(always)]
    pub fn idle(pwm: pwm::Limits) -> Gateway {
        Gateway {
            slots: heapless::Vec::new(),
            t7: BusTask::idle(Timing::t7(Serial::T7_DEFAULT)),
            #[cfg(feature = "isu")]
            isu: BusTask::idle(Timing::isu()),
            pwm: PwmInputs::new(pwm),
            changed: Bits::EMPTY,
            generation: 0,
            trace: Trace::new(),
            fingerprint: 0,
            degraded: DegradedMode::None,
            console: ConsoleSettings::DEFAULT,
            watched: Bits::EMPTY,
            watch_at: Instant::ZERO,
        }
    }

    /// A gateway that has read nothing yet.
    pub fn new(settings: &Settings, pwm: pwm::Limits) -> Gateway {
        let mut gateway = Gateway::idle(pwm);
        gateway.set_up(&settings.slots, &settings.t7, &settings.isu);
        gateway.console = settings.console;
        gateway
    }

    /// Takes these slots, beginning with the first, the others off, and these buses. Before it begins: what was read so
    /// far and what is under way is lost.
    #[inline(never)]
    pub fn set_up(&mut self, table: &[SlotConfig], t7: &BusSettings, isu: &BusSettings) {
        for slot in 0..MAX_SLOTS {
            self.set_slot(slot, table.get(slot).unwrap_or(&SlotConfig::OFF));
        }
        self.set_bus(Bus::T7, t7);
        self.set_bus(Bus::Isu, isu);
    }
}

/// Settings can be read at any time. Set them here only before the gateway begins; afterwards with
/// [`carry_out`](Gateway::carry_out).
impl Configuration for Gateway {
    fn slot(&self, slot: usize) -> Option<&SlotConfig> {
        self.config(slot)
    }

    /// Of a bus that this build does not have, the first ones.
    fn bus(&self, bus: Bus) -> BusSettings {
        if bus.is_built() { *self.bus_settings(bus) } else { BusSettings::first(bus) }
    }

    fn set_slot(&mut self, slot: usize, config: &SlotConfig) {
        while self.slots.len() <= slot && self.slots.push(Polled::new(SlotConfig::OFF)).is_ok() {
            self.note_settings(self.slots.len().saturating_sub(1));
        }
        self.note_settings(slot);
        let Some(place) = self.slots.get_mut(slot) else { return };
        *place = Polled::new(*config);
        self.note_settings(slot);
        self.reset(slot);
        // A slot that is off is empty, as every reader assumes.
        self.changed.set(slot, *config != SlotConfig::OFF);
    }

    fn set_bus(&mut self, bus: Bus, settings: &BusSettings) {
        match bus {
            Bus::T7 => self.t7.set_up(settings),
            #[cfg(feature = "isu")]
            Bus::Isu => self.isu.set_up(settings),
            #[cfg(not(feature = "isu"))]
            Bus::Isu => {}
        }
    }

    fn console(&self) -> ConsoleSettings {
        self.console
    }

    fn set_console(&mut self, settings: &ConsoleSettings) {
        self.console = *settings;
    }
}
