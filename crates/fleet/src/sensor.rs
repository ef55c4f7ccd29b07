//! What is known of one sensor: the last thing its source said of it.

use std::sync::Arc;
use std::time::Instant;

use clino_codec::angle::Angle;

use crate::clock::Wall;

/// A turn, in millidegrees: the gateway publishes no angle of a whole one, either way.
pub const TURN_MDEG: i32 = 360_000;
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
    /// Only while the status is *ok*.
    pub angle: Option<Angle>,
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
    pub fn value(&self) -> Option<Angle> {
        self.angle.filter(|_| &*self.status == OK)
    }

    /// The same sensor once its source has gone: no value, whatever was there.
    pub fn gone(&self) -> Outcome {
        Outcome { status: SOURCE_GONE.into(), angle: None, ..self.clone() }
    }

    /// The age of the last good value, in milliseconds.
    pub fn age_ms(&self, now: Instant) -> Option<u64> {
        let age = now.saturating_duration_since(self.measured_at?);
        Some(u64::try_from(age.as_millis()).unwrap_or(u64::MAX))
    }
}

/// In degrees, for formats that have floating point. To the millidegree, as the gateway publishes it.
pub fn degrees(angle: Angle) -> f64 {
    f64::from(angle.mdeg()) / 1_000.0
}
