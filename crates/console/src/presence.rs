//! Presence of a person or program: time since the last typed character, and echo of the gateway's own lines.
//!
//! A prompt at which nothing is typed for the idle time is unattended: the stream of readings resumes. A line that was begun
//! there waits ten times as long. Characters that the receiver reports as disturbed do not count: a cable that picks up noise
//! does not hold the prompt.
//!
//! An echo is recognised by lines that only the gateway writes (`line.rs`). No such line is answered, and for a while after
//! one an empty line is taken for a line end of the echo, not for a person who presses Enter. While the stream runs, lines
//! come back at least once a second, as the statistics are printed: no output provokes output without end.

use clino_bus::{Duration, Instant};

use crate::stream::STATISTICS_EVERY;

/// How many idle times a line that was begun waits.
const BEGUN: u64 = 10;
/// Longest delay of an echo, and as much again.
const ECHO_DELAY: Duration = Duration::from_millis(1_000);

/// Whether a person or program is there.
pub struct Presence {
    heard: Instant,
    /// The last character followed at once on the one before, as characters of one line of an echo do.
    is_flowing: bool,
    /// An empty line is an echo until then.
    echo_until: Instant,
    /// Lines that were damaged, since reset.
    pub damaged: u32,
    /// Lines of the gateway's own that came back, since reset.
    pub own: u32,
}

impl Presence {
    /// Nothing was typed yet.
    pub const fn new() -> Presence {
        Presence { heard: Instant::ZERO, is_flowing: false, echo_until: Instant::ZERO, damaged: 0, own: 0 }
    }

    /// Something is typed, or printed for a person.
    pub fn is_here(&mut self, now: Instant) {
        self.is_flowing = now.since(self.heard) < ECHO_DELAY;
        self.heard = now;
    }

    /// Whether a prompt is left alone for the idle time, if there is one. `begun`: a line stands at it.
    pub fn is_gone(&self, now: Instant, idle_ms: Option<u32>, begun: bool) -> bool {
        let times = if begun { BEGUN } else { 1 };
        idle_ms.is_some_and(|ms| now.millis_since(self.heard) >= u64::from(ms).saturating_mul(times))
    }

    /// A line of the gateway's own has come back.
    pub fn echo(&mut self, now: Instant) {
        self.own = self.own.saturating_add(1);
        if self.is_flowing {
            self.echo_until = now + STATISTICS_EVERY.times(2) + ECHO_DELAY;
        }
    }

    /// Whether such lines come back.
    pub fn is_echoing(&self, now: Instant) -> bool {
        now < self.echo_until
    }
}
