//! Waits for a port that delivers late.

use clino_bus::{Duration, Timing};

/// The same waits, for characters that are read up to `latency` after they were on the pair. A batch may end anywhere, so that
/// a gap within an answer is prolonged as well as the wait for its beginning.
pub fn widened(timing: Timing, latency: Duration) -> Timing {
    Timing {
        get_latency: timing.get_latency + latency,
        set_latency: timing.set_latency + latency,
        gap: timing.gap + latency,
        patience: timing.patience + latency,
        late: timing.late + latency,
        // A computer that is busier than usual: once again as much, learnt from answers that were late.
        extension: timing.extension.max(latency),
        line_busy: timing.line_busy + latency,
        ..timing
    }
}

/// A wait, for the system.
pub fn to_system(duration: Duration) -> std::time::Duration {
    std::time::Duration::from_micros(duration.as_micros().into())
}

/// A wait of the system, for the bus.
pub fn of_system(duration: std::time::Duration) -> Duration {
    u32::try_from(duration.as_micros()).map_or(Duration::MAX, Duration::from_micros)
}
