//! How the true angle of a sensor moves.

use clino_sim::motion::Motion;
use serde::Deserialize;
use toml::Spanned;

use crate::scenario::units::{Degrees, Number, Time};

/// How the true angle moves.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Moves {
    /// Not at all: degrees.
    Constant(Number<Degrees>),
    /// At a constant rate.
    Ramp {
        /// Degrees at time 0.
        #[serde(default)]
        start: Number<Degrees>,
        /// Degrees per second.
        rate: Number<Degrees>,
    },
    /// To and fro.
    Sine {
        /// Middle of the swing in degrees.
        #[serde(default)]
        centre: Number<Degrees>,
        /// Half of the swing in degrees.
        amplitude: Number<Degrees>,
        /// One full swing.
        period: Time,
        /// Phase at time 0 in degrees.
        #[serde(default)]
        phase: Number<Degrees>,
    },
    /// Points joined by straight lines.
    Table(Vec<Spanned<Point>>),
}

/// A point of a motion table.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Point {
    /// When.
    pub at: Time,
    /// Where, in degrees.
    pub angle: Number<Degrees>,
}

impl Moves {
    /// The motion in the simulator's terms.
    pub fn motion(&self) -> Motion {
        match self {
            Self::Constant(angle) => Motion::Constant(angle.0),
            Self::Ramp { start, rate } => Motion::Ramp { start: start.0, rate: rate.0 },
            Self::Sine { centre, amplitude, period, phase } => {
                Motion::Sine { centre: centre.0, amplitude: amplitude.0, period: period.0, phase: phase.0 }
            }
            Self::Table(points) => {
                let point = |point: &Spanned<Point>| (point.get_ref().at.0, point.get_ref().angle.0);
                Motion::Table(points.iter().map(point).collect())
            }
        }
    }
}
