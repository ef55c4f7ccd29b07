//! Waits for a port that delivers late.

use std::time::Duration;

use clino_bus::{Micros, Timing};

/// The same waits, for characters that are read up to `latency` after they were on the pair. A batch may end anywhere, so that
/// a gap within an answer is prolonged as well as the wait for its beginning.
pub fn widened(timing: Timing, latency: Micros) -> Timing {
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
pub fn duration(span: Micros) -> Duration {
    Duration::from_micros(span.0)
}

/// A wait of the system, for the bus.
pub fn micros(span: Duration) -> Micros {
    Micros(u64::try_from(span.as_micros()).unwrap_or(u64::MAX))
}
