//! The PWM output of an ISU against its own serial line.
//!
//! Both tell the angle of the same refresh (AN #201 section 4), but the serial one is read up to two refreshes later. So they
//! have to disagree for [`STRIKES`] cycles on end before that is said, and while the sensor turns, nothing is.

use clino_bus::Micros;
use clino_codec::angle::Angle;

use super::Gateway;
use crate::bits::Bits;
use crate::config::Bus;
use crate::health::{Health, Strikes};
use crate::maths::step;

/// PWM cycles of 33 ms: 1.6 s, three refreshes.
const STRIKES: u8 = 48;
/// Micro-degrees of a thousandth of a degree, of which tolerances and, in a second, rates are made.
const UDEG_PER_MDEG: u32 = 1_000;

impl Gateway {
    /// The PWM slots whose ISU may still say numbers that mean something else.
    #[inline(never)]
    pub(super) fn settling_inputs(&self, now: Micros) -> Bits {
        let mut settling = Bits::EMPTY;
        for index in self.listening.iter() {
            let partner = self.slots.get(index).and_then(|slot| slot.config.partner);
            let partner = partner.and_then(|partner| self.slots.get(usize::from(partner)));
            let is_settling = match partner.and_then(|slot| slot.config.source.node()) {
                Some((Bus::T7, address)) => self.t7.is_settling(address, now),
                Some((Bus::Isu, address)) => self.isu.is_settling(address, now),
                None => false,
            };
            settling.set(index, is_settling);
        }
        settling
    }

    /// The slot means something else now: a PWM input that is compared with it begins anew.
    #[inline(never)]
    pub(super) fn forget_partner(&mut self, partner: usize) {
        for index in self.listening.iter() {
            let Some(slot) = self.slots.get_mut(index) else { continue };
            if slot.config.partner.map(usize::from) != Some(partner) {
                continue;
            }
            slot.strikes = Strikes::default();
            if slot.health.has(Health::DISAGREES) {
                slot.health.set(Health::DISAGREES, false);
                self.changed.set(index, true);
            }
        }
    }

    /// Compares a PWM slot with its partner, if both have a value.
    pub(super) fn compare(&mut self, index: usize, now: Micros) {
        let Some(slot) = self.slots.get(index) else { return };
        let partner = slot.config.partner.and_then(|partner| self.slots.get(usize::from(partner)));
        let Some(((own, rate), (other, other_rate))) =
            slot.sound(now).zip(partner.and_then(|partner| partner.sound(now)))
        else {
            return;
        };
        let tolerance = u32::from(slot.config.tolerance).saturating_mul(UDEG_PER_MDEG);
        // Within a second it would turn by more than may differ.
        let turns = |rate: i32| rate.unsigned_abs().saturating_mul(UDEG_PER_MDEG) > tolerance;
        if turns(rate) || turns(other_rate) {
            return;
        }
        let fits = is_close(own, other, tolerance);
        let Some(slot) = self.slots.get_mut(index) else { return };
        let speaks = slot.strikes.count(fits, STRIKES);
        if slot.health.has(Health::DISAGREES) != speaks {
            slot.health.set(Health::DISAGREES, speaks);
            self.changed.set(index, true);
        }
    }
}

fn is_close(one: Angle, other: Angle, tolerance: u32) -> bool {
    step(one, other).unsigned_abs() <= tolerance
}
