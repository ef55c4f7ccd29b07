//! The true angle of a sensor over time.
//!
//! Angles are micro-degrees (µ°, 1e-6 °) in `i64`, unwrapped: a ramp goes on past a full turn. The
//! normalisers at the end bring an angle into one of the two ranges in use. Every function is total and gives
//! the same result on every machine.

use core::f64::consts::TAU;

use crate::node::Ns;

/// Micro-degrees in one degree.
pub const DEGREE: i64 = 1_000_000;

/// Micro-degrees in a full turn.
pub const TURN: i64 = 360 * DEGREE;

const NS_PER_SECOND: i128 = 1_000_000_000;

/// How the true angle changes with time. All angles are micro-degrees.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Motion {
    /// The angle never changes.
    Constant(i64),
    /// The angle changes at a constant rate.
    Ramp {
        /// Angle at time 0, in µ°.
        start: i64,
        /// Rate in µ°/s; negative turns back.
        rate: i64,
    },
    /// `centre + amplitude · sin(2π · t / period + phase)`.
    Sine {
        /// Middle of the swing, in µ°.
        centre: i64,
        /// Half of the swing, in µ°.
        amplitude: i64,
        /// One full swing, in ns. 0 keeps the sensor where the phase puts it.
        period: Ns,
        /// Phase at time 0, in µ°.
        phase: i64,
    },
    /// Points `(time, angle)` in order of time, joined by straight lines; the first and the last angle are
    /// held before and after. Two points at the same instant are a step. An empty table is 0°.
    Table(Vec<(Ns, i64)>),
}

impl Motion {
    /// The unwrapped angle at `t`, in µ°.
    #[must_use]
    pub fn at(&self, t: Ns) -> i64 {
        match self {
            Self::Constant(angle) => *angle,
            Self::Ramp { start, rate } => {
                clamp(i128::from(*start) + i128::from(*rate) * i128::from(t) / NS_PER_SECOND)
            }
            Self::Sine { centre, amplitude, period, phase } => {
                let turns = t.checked_rem(*period).map_or(0.0, |rest| rest as f64 / *period as f64)
                    + unidirectional(*phase) as f64 / TURN as f64;
                centre.saturating_add(libm::round(*amplitude as f64 * libm::sin(TAU * turns)) as i64)
            }
            Self::Table(points) => on_polyline(points, t),
        }
    }
}

impl Default for Motion {
    fn default() -> Self {
        Self::Constant(0)
    }
}

/// The angle at `t` on the line through `points`; a point is reached at its own instant.
fn on_polyline(points: &[(Ns, i64)], t: Ns) -> i64 {
    let (past, future) = points.split_at(points.partition_point(|&(at, _)| at <= t));
    match (past.last(), future.first()) {
        (Some(&(t0, a0)), Some(&(t1, a1))) => {
            let (span, gone) = (i128::from(t1 - t0), i128::from(t - t0));
            clamp(i128::from(a0) + (i128::from(a1) - i128::from(a0)) * gone / span)
        }
        (Some(&(_, held)), None) | (None, Some(&(_, held))) => held,
        (None, None) => 0,
    }
}

fn clamp(angle: i128) -> i64 {
    angle.clamp(i128::from(i64::MIN), i128::from(i64::MAX)) as i64
}

/// The same direction in 0° ≤ angle < 360°, in µ°.
#[must_use]
pub fn unidirectional(angle: i64) -> i64 {
    angle.rem_euclid(TURN)
}

/// The same direction in −180° ≤ angle < 180°, in µ°.
#[must_use]
pub fn bidirectional(angle: i64) -> i64 {
    let positive = unidirectional(angle);
    if positive >= TURN / 2 { positive - TURN } else { positive }
}
