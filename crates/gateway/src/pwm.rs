//! The PWM inputs: from a captured cycle to the value of the slots that read it, and the comparison with the serial
//! line of the same ISU.
//!
//! Both outputs say the angle of the same refresh (AN #201 section 4), but the serial one is read up to two refreshes
//! later. So the signal is raised only after they have disagreed for [`STRIKES`] cycles in a row, and not while
//! the sensor turns.

use clino_bus::Instant;
use clino_codec::angle::Angle;
use clino_codec::pwm::{self, Law, Limits, PwmFault};

use crate::bits::Bits;
use crate::config::{Bus, PwmInput, Source};
use crate::event::Capture;
use crate::health::Health;
use crate::schedule::Polled;
use crate::slot::{Sample, Slot, Strikes, step};
use crate::value::Status;

/// PWM cycles of 33 ms: 1.6 s, three refreshes.
const STRIKES: u8 = 48;
/// Micro-degrees of a thousandth of a degree, of which tolerances and, in a second, rates are made.
const UDEG_PER_MDEG: u32 = 1_000;
/// Two PWM cycles this close are the same, in µ°: two steps of 4.34 µs.
const RESOLUTION: u32 = 180_000;

/// What is known of the PWM inputs.
pub(crate) struct PwmInputs {
    limits: Limits,
    lost_edges: u32,
    /// Slots that read a PWM input.
    listening: Bits,
}

impl PwmInputs {
    /// Inputs that no slot reads. What counts as a cycle is in `limits`.
    pub const fn new(limits: Limits) -> PwmInputs {
        PwmInputs { limits, lost_edges: 0, listening: Bits::EMPTY }
    }

    /// Cycles that were dropped because an edge was lost, both inputs together; wraps.
    pub const fn lost_edges(&self) -> u32 {
        self.lost_edges
    }

    /// The slot reads something else now. Returns the slots that have changed with it: a PWM input that is compared
    /// with it begins anew.
    #[inline(never)]
    pub fn forget(&mut self, index: usize, slots: &mut [Polled]) -> Bits {
        let listens = slots.get(index).is_some_and(|polled| listens(&polled.slot));
        self.listening.set(index, listens);
        let mut changed = Bits::EMPTY;
        for listener in self.listening.iter() {
            let Some(Polled { slot, .. }) = slots.get_mut(listener) else { continue };
            if slot.config.partner.map(usize::from) != Some(index) {
                continue;
            }
            slot.strikes = Strikes::default();
            if slot.health.has(Health::DISAGREES) {
                slot.health.set(Health::DISAGREES, false);
                changed.set(listener, true);
            }
        }
        changed
    }

    /// Takes what a timer input saw at `now`. `is_settling` says whether the numbers of a node are not used yet.
    /// Returns the slots that have changed.
    pub fn take(
        &mut self,
        input: PwmInput,
        capture: Capture,
        now: Instant,
        slots: &mut [Polled],
        is_settling: &dyn Fn(Bus, u8) -> bool,
    ) -> Bits {
        let result = self.measure(capture);
        let settling = self.settling(slots, is_settling);
        let mut changed = Bits::EMPTY;
        for index in self.listening.iter() {
            let Some(polled) = slots.get_mut(index).filter(|polled| polled.slot.is(&Source::Pwm { input }))
            else {
                continue;
            };
            let slot = &mut polled.slot;
            // One cycle without its edge is no fault yet.
            if capture == Capture::LostEdge && !slot.is_stale(now) {
                continue;
            }
            if result.is_err() {
                slot.distrust();
            }
            if result.is_ok() && settling.has(index) {
                continue;
            }
            if slot.settle(result, now, true, RESOLUTION) {
                changed.set(index, true);
            }
            if compare(index, now, slots) {
                changed.set(index, true);
            }
        }
        changed
    }

    /// What a capture says.
    fn measure(&mut self, capture: Capture) -> Result<Sample, Status> {
        match capture {
            Capture::Cycle(ticks) => pwm::measure(ticks, &self.limits, Law::Documented)
                .map(|reading| Sample::new(reading.angle))
                .map_err(|fault| match fault {
                    PwmFault::Period { .. } => Status::BadPeriod,
                    _ => Status::OutOfRange,
                }),
            Capture::LostEdge => {
                self.lost_edges = self.lost_edges.wrapping_add(1);
                Err(Status::NoSignal)
            }
            Capture::NoSignal { high: true } => Err(Status::StuckHigh),
            Capture::NoSignal { high: false } => Err(Status::StuckLow),
        }
    }

    /// The PWM slots whose ISU may still send angles from before a change of its settings.
    #[inline(never)]
    fn settling(&self, slots: &[Polled], is_settling: &dyn Fn(Bus, u8) -> bool) -> Bits {
        let mut settling = Bits::EMPTY;
        for index in self.listening.iter() {
            let slot = slots.get(index).map(|polled| &polled.slot);
            let partner = slot.and_then(|slot| partner(slot, slots));
            let node = partner.and_then(|slot| slot.config.source.node());
            settling.set(index, node.is_some_and(|(bus, address)| is_settling(bus, address)));
        }
        settling
    }
}

/// Whether a slot reads a PWM input.
fn listens(slot: &Slot) -> bool {
    slot.config.enabled && matches!(slot.config.source, Source::Pwm { .. })
}

/// The slot that reads the same ISU over its serial line.
fn partner<'a>(slot: &Slot, slots: &'a [Polled]) -> Option<&'a Slot> {
    slots.get(usize::from(slot.config.partner?)).map(|polled| &polled.slot)
}

/// Compares a PWM slot with its partner, if both have a value. Returns whether the slot's signal has changed.
fn compare(index: usize, now: Instant, slots: &mut [Polled]) -> bool {
    let Some(slot) = slots.get(index).map(|polled| &polled.slot) else { return false };
    let Some(((own, rate), (other, other_rate))) =
        slot.sound(now).zip(partner(slot, slots).and_then(|partner| partner.sound(now)))
    else {
        return false;
    };
    let tolerance = u32::from(slot.config.tolerance).saturating_mul(UDEG_PER_MDEG);
    // Within a second it would turn by more than may differ.
    let turns = |rate: i32| rate.unsigned_abs().saturating_mul(UDEG_PER_MDEG) > tolerance;
    if turns(rate) || turns(other_rate) {
        return false;
    }
    let fits = is_close(own, other, tolerance);
    let Some(Polled { slot, .. }) = slots.get_mut(index) else { return false };
    let speaks = slot.strikes.count(fits, STRIKES);
    let changes = slot.health.has(Health::DISAGREES) != speaks;
    slot.health.set(Health::DISAGREES, speaks);
    changes
}

fn is_close(one: Angle, other: Angle, tolerance: u32) -> bool {
    step(one, other).unsigned_abs() <= tolerance
}
