//! The properties of an RS485 segment: noise, and faults of the line.

use serde::Deserialize;
use toml::Spanned;

use super::intervals::{Interval, Stuck};
use crate::scenario::units::{Chances, Number};

/// The two RS485 segments.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Segments {
    /// The T7 bus.
    pub t7: Segment,
    /// The ISU bus.
    pub isu: Segment,
}

/// One RS485 segment.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Segment {
    /// The gateway hears itself (RE̅ of its transceiver always on).
    pub echo: bool,
    /// Disturbances for every receiver.
    pub noise: Noise,
    /// When the pair is shorted.
    pub stuck: Vec<Spanned<Stuck>>,
    /// When the gateway's driver cannot be switched off.
    pub de_shorted: Vec<Spanned<Interval>>,
}

/// Disturbances of a segment.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Noise {
    /// Probability that a sampled bit is inverted.
    pub bit_error_rate: Number<Chances>,
    /// Probability that a receiver loses a character.
    pub drop_rate: Number<Chances>,
    /// When; always if it does not say.
    pub within: Option<Spanned<Interval>>,
}
