//! From the true motion to the numbers a T7 reports.
//!
//! - Angles are 0.001° in `i32`. `reported = ± absolute + offset`, kept in the output range (sections 2.2,
//!   2.6). The document does not say where the direction comes in; here it negates the absolute angle and
//!   leaves the offset alone.
//! - Accelerations are 1/102300 g in `i32` (section 1). The document does not say how they relate to the
//!   angles. Here they are gravity as seen by a sensor at the true angles, with a length of 1 g: for a T7-1
//!   turning about its horizontal axis 2, and for a T7-3 rolled by the angle of axis 0 and pitched by that
//!   of axis 1.

use super::Damping;
use super::settings::{AXES, Direction, Model, OutputRange, SINGLE_AXIS, StoredSettings};
use crate::motion::{self, Motion};
use crate::node::Ns;

/// Units of 0.001° in a full turn.
const TURN: i32 = 360_000;

/// Micro-degrees in 0.001°.
const MICRO_PER_MILLI: i64 = 1000;

/// Acceleration units in 1 g.
const G: f64 = 102_300.0;

/// Readings that the averaging model takes over one damping time.
const READINGS: u64 = 16;

const NS_PER_MS: u64 = 1_000_000;

/// The angle brought into an output range, in 0.001°.
pub(super) fn in_range(angle: i32, range: OutputRange) -> i32 {
    let positive = angle.rem_euclid(TURN);
    match range {
        OutputRange::Bidirectional if positive >= TURN / 2 => positive - TURN,
        _ => positive,
    }
}

/// Whether an angle lies in an output range without a turn added.
pub(super) fn fits(angle: i32, range: OutputRange) -> bool {
    in_range(angle, range) == angle
}

/// Whether a model measures an axis.
pub(super) fn has_axis(model: Model, axis: usize) -> bool {
    axis < AXES && (model == Model::T73 || axis == SINGLE_AXIS)
}

/// What the sensor measures at `t`, before direction and offset, in 0.001°, 0 … 359.999°.
pub(super) fn absolute(motion: &Motion, damping: Damping, damping_ms: u16, t: Ns) -> i32 {
    let micro = match damping {
        Damping::Ignored => motion.at(t),
        Damping::Averaged => average(motion, u64::from(damping_ms) * NS_PER_MS, t),
    };
    // Less than a turn in 0.001° always fits.
    ((motion::unidirectional(micro) + MICRO_PER_MILLI / 2) / MICRO_PER_MILLI) as i32 % TURN
}

/// Mean of equally spaced readings over the damping time up to `t`. Before time 0 the sensor stood still.
fn average(motion: &Motion, window: Ns, t: Ns) -> i64 {
    let sum: i128 =
        (0..READINGS).map(|i| i128::from(motion.at(t.saturating_sub(window * i / READINGS)))).sum();
    (sum / i128::from(READINGS)) as i64
}

/// The absolute angle turned by the axis' direction.
pub(super) fn directed(absolute: i32, direction: Direction) -> i32 {
    match direction {
        Direction::Normal => absolute,
        Direction::Reversed => -absolute,
    }
}

/// What the sensor reports for an axis whose absolute angle is known, in 0.001°.
pub(super) fn reported(absolute: i32, axis: usize, settings: &StoredSettings) -> i32 {
    let offset = settings.offsets[axis].rem_euclid(TURN);
    in_range(directed(absolute, settings.directions[axis]) + offset, settings.range)
}

/// Gravity in the sensor's frame in 1/102300 g, from true angles in µ°.
pub(super) fn accelerations(model: Model, angles: [i64; AXES]) -> [i32; AXES] {
    let (sines, cosines) = (angles.map(|a| libm::sin(radians(a))), angles.map(|a| libm::cos(radians(a))));
    let [roll, pitch, turn] = [0, 1, SINGLE_AXIS];
    let gravity = match model {
        Model::T71 => [sines[turn], cosines[turn], 0.0],
        Model::T73 => [-sines[pitch], sines[roll] * cosines[pitch], cosines[roll] * cosines[pitch]],
    };
    gravity.map(|g| libm::round(g * G) as i32)
}

fn radians(micro: i64) -> f64 {
    motion::unidirectional(micro) as f64 / motion::TURN as f64 * core::f64::consts::TAU
}
