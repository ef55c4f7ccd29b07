//! Start-up, supervision of the EEPROM, and measurement.
//!
//! Angles are computed when they are read, not by events of their own: their instants are known.
//!
//! Source: "Interfacing to an ISU Module", sections 3, 4 ("Module is in Error State") and 6.

use super::angle::{self, Schedule};
use super::command::CURRENT_ANGLE;
use super::{Active, Isu, Mode, Power, RAM_SIZE, Supervision};
use crate::node::Ns;

impl Isu {
    /// Power-up or reset begins.
    pub(super) fn restart(&mut self, now: Ns) {
        self.power = Power::Booting { ready_at: now + self.options.boot_time };
        self.ascii.reset();
    }

    /// Power-up or reset is over.
    pub(super) fn boot(&mut self, now: Ns) {
        self.power = Power::On;
        self.mode = if self.eeprom.is_sound() { Mode::Normal } else { Mode::HardError };
        self.adopt();
        self.ram = [0; RAM_SIZE];
        self.schedule = Schedule { origin: now, phase: self.options.phase };
        self.receiver.reset();
        self.measure(now);
        self.ascii.ready(now);
    }

    pub(super) fn adopt(&mut self) {
        self.active = Active { address: self.eeprom.address(), null: self.eeprom.null() };
    }

    /// Takes the angle at `at`, if the module is healthy.
    fn measure(&mut self, at: Ns) {
        self.measured_at = at;
        let corrupted = self.options.supervision == Supervision::Continuous && !self.eeprom.is_sound();
        if self.mode == Mode::Normal && (corrupted || self.no_valid_angle) {
            self.mode = Mode::HardError;
        }
        if self.mode == Mode::Normal {
            self.measured = angle::from_microdegrees(self.options.motion.at(at));
            let code = self.measured.wrapping_sub(self.active.null);
            let [high, low] = code.to_be_bytes();
            self.ram[usize::from(CURRENT_ANGLE)] = high;
            self.ram[usize::from(CURRENT_ANGLE) + 1] = low;
        }
    }

    /// Brings the angle up to date. Angles that no request could have read are skipped.
    pub(super) fn refresh(&mut self, now: Ns) {
        let latest = self.schedule.latest(now);
        if latest > self.measured_at {
            self.measure(latest);
        }
    }
}
