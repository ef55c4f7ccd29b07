//! Cross-checks: two values of a sensor that have to agree. Their outcomes are signals ([`Health`]) beside the value.
//!
//! - The PWM output of an ISU against its own serial line (`SlotConfig::partner`, compared in `pwm.rs`).
//! - The accelerations of a T7 against gravity. The guide gives them in section 2.3 and says nothing of how they relate
//!   to the angles, nor how the axes lie; its one example cannot be explained by any simple relation. What holds in any
//!   case is that a device at rest measures 1 g in all, so that is checked.
//! - The failures among the last requests ([`Link`]).
//!
//! A check raises its signal after several failures in a row, so that a moving sensor, whose two outputs are not of the
//! same instant, raises none; the first success ends it.
//!
//! [`Health`]: crate::Health

use clino_codec::t7::Acceleration;

/// A check that raises its signal after several failures in a row.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Strikes(u8);

impl Strikes {
    /// Takes the outcome of a check; returns whether it has failed `enough` times in a row.
    pub fn count(&mut self, fits: bool, enough: u8) -> bool {
        self.0 = if fits { 0 } else { self.0.saturating_add(1) };
        self.0 >= enough
    }
}

/// Requests over which failures are counted.
const REQUESTS: u8 = 200;

/// The failures among the last requests.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Link {
    requests: u8,
    failures: u8,
}

impl Link {
    /// Takes the outcome of a request. Returns the verdict at the end of [`REQUESTS`], and at once when it is clear.
    pub fn count(&mut self, failed: bool) -> Option<bool> {
        self.requests = self.requests.saturating_add(1);
        self.failures = self.failures.saturating_add(failed.into());
        let noisy = self.failures > 1;
        let over = self.requests >= REQUESTS;
        if over {
            *self = Link::default();
        }
        (noisy || over).then_some(noisy)
    }
}

/// Steps of acceleration per thousandth of g, times ten: 102 300 per g.
const STEPS_PER_10_MG: i64 = 1_023;

/// Whether the accelerations add up to 1 g within `tolerance` thousandths of g.
pub(crate) fn is_one_g(accelerations: &[Acceleration; 3], tolerance: u16) -> bool {
    let square = |steps: i64| steps.saturating_mul(steps);
    let sum = accelerations.iter().map(|a| square(a.0.into())).fold(0, i64::saturating_add);
    let steps = |milli_g: i64| milli_g.max(0).saturating_mul(STEPS_PER_10_MG) / 10;
    let tolerance = i64::from(tolerance);
    let least = square(steps(1_000_i64.saturating_sub(tolerance)));
    let most = square(steps(tolerance.saturating_add(1_000)));
    (least..=most).contains(&sum)
}

#[cfg(test)]
mod tests;
