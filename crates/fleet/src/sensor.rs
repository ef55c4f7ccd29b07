//! What is known of one sensor: the last thing its source said of it.

use std::sync::Arc;
use std::time::Instant;

use crate::clock::Wall;

/// The gateway's word for a value that is right and fresh.
pub const OK: &str = "ok";
/// Status of every sensor whose source is away. The gateway's own words are in `docs/console.md`.
pub const SOURCE_GONE: &str = "source_gone";

/// One outcome of a sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// `t7`, `isu` or `pwm`.
    pub kind: Arc<str>,
    /// `t7`, `isu`, `pwm1` or `pwm2`.
    pub bus: Arc<str>,
    /// Address on the bus, 0 for PWM.
    pub address: u8,
    /// `ok`, or why there is no angle, in the gateway's words.
    pub status: Arc<str>,
    /// In millidegrees; only while the status is *ok*.
    pub angle_mdeg: Option<i32>,
    /// When the last good value was measured: reception minus age. Unknown where there was none, or where the gateway no
    /// longer tells its age.
    pub measured: Option<Wall>,
    /// The same on the clock that does not jump.
    pub measured_at: Option<Instant>,
    /// Signals beside the value.
    pub health: Vec<Arc<str>>,
    /// The gateway's counter of outcomes of this slot.
    pub outcome: u32,
}

impl Outcome {
    /// The angle, if there is one that may be shown as such.
    pub fn angle(&self) -> Option<i32> {
        self.angle_mdeg.filter(|_| &*self.status == OK)
    }

    /// The same sensor once its source has gone: no value, whatever was there.
    pub fn gone(&self) -> Outcome {
        Outcome { status: SOURCE_GONE.into(), angle_mdeg: None, ..self.clone() }
    }

    /// The age of the last good value, in milliseconds.
    pub fn age_ms(&self, now: Instant) -> Option<u64> {
        let age = now.saturating_duration_since(self.measured_at?);
        Some(u64::try_from(age.as_millis()).unwrap_or(u64::MAX))
    }
}

/// Degrees with the three decimals that a sensor has, exactly.
pub fn degrees(mdeg: i32) -> String {
    let sign = if mdeg < 0 { "-" } else { "" };
    let magnitude = mdeg.unsigned_abs();
    format!("{sign}{}.{:03}", magnitude / 1_000, magnitude % 1_000)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn degrees_are_written_exactly() {
        for (mdeg, text) in
            [(0, "0.000"), (-1, "-0.001"), (12_345, "12.345"), (-180_000, "-180.000"), (359_999, "359.999")]
        {
            assert_eq!(degrees(mdeg), text);
        }
        assert_eq!(degrees(i32::MIN), "-2147483.648");
    }
}
