//! The PWM sources.

use clino_sim::pwm;
use serde::Deserialize;
use toml::Spanned;

use super::intervals::{Interval, Stuck};
use super::motion::Moves;
use crate::scenario::units::{Hertz, Number};

/// A PWM source.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pwm {
    /// PWM input 1 or 2.
    pub channel: Spanned<u8>,
    /// How the sensor moves, relative to its null position.
    pub motion: Moves,
    /// Frequency in Hz.
    pub frequency: Option<Number<Hertz>>,
    /// How finely the high time is set.
    #[serde(default)]
    pub resolution: Resolution,
    /// When the line stands still.
    #[serde(default)]
    pub stuck: Vec<Spanned<Stuck>>,
    /// When its cable is cut.
    #[serde(default)]
    pub open: Vec<Spanned<Interval>>,
}

/// How finely a PWM source sets its high time.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Resolution {
    /// In the 4.34 µs steps of the module.
    #[default]
    Steps,
    /// In nanoseconds.
    Ideal,
}

impl From<Resolution> for pwm::Quantisation {
    fn from(resolution: Resolution) -> Self {
        match resolution {
            Resolution::Steps => Self::Steps,
            Resolution::Ideal => Self::Ideal,
        }
    }
}
