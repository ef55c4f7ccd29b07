//! Intervals of time in which something is out of order.

use clino_sim::node::Ns;
use serde::Deserialize;
use toml::Spanned;

use crate::scenario::units::Time;

/// From one instant until just before another.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Interval {
    /// First instant.
    pub from: Time,
    /// First instant after.
    pub until: Time,
}

/// An interval of babble.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Babble {
    /// First start bit.
    pub from: Time,
    /// No character begins at or after this.
    pub until: Time,
    /// Pause between two characters; none if it does not say.
    #[serde(default)]
    pub gap: Time,
}

impl Babble {
    /// In the segment's terms.
    pub fn in_segment(&self) -> clino_segment::Babble {
        clino_segment::Babble { from: self.from.0, until: self.until.0, gap: self.gap.0 }
    }
}

/// An interval in which a line stands still.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stuck {
    /// First instant.
    pub from: Time,
    /// First instant after.
    pub until: Time,
    /// Where it stands.
    pub level: StuckLevel,
}

/// Level of a line that stands still.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StuckLevel {
    /// At 0 V.
    Low,
    /// At the supply.
    High,
}

/// Anything that lasts from one instant until another.
pub trait Lasting {
    /// First instant, and first instant after.
    fn bounds(&self) -> (Ns, Ns);
}

impl Lasting for Interval {
    fn bounds(&self) -> (Ns, Ns) {
        (self.from.0, self.until.0)
    }
}

impl Lasting for Babble {
    fn bounds(&self) -> (Ns, Ns) {
        (self.from.0, self.until.0)
    }
}

impl Lasting for Stuck {
    fn bounds(&self) -> (Ns, Ns) {
        (self.from.0, self.until.0)
    }
}

/// The bounds of each.
pub fn bounds<T: Lasting>(intervals: &[Spanned<T>]) -> Vec<(Ns, Ns)> {
    intervals.iter().map(|interval| interval.get_ref().bounds()).collect()
}
