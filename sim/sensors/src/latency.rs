//! How long a sensor takes: fixed, or drawn from a range with a seeded generator.

use oorandom::Rand64;

use crate::node::Ns;

/// A time between `min` and `max`, both included, in nanoseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Latency {
    /// Shortest time.
    pub min: Ns,
    /// Longest time; one below `min` counts as `min`.
    pub max: Ns,
}

impl Latency {
    /// Always the same time.
    #[must_use]
    pub const fn fixed(time: Ns) -> Self {
        Self { min: time, max: time }
    }

    /// Any time from `min` to `max`, each equally likely.
    #[must_use]
    pub const fn between(min: Ns, max: Ns) -> Self {
        Self { min, max }
    }

    /// Draws one time. A fixed latency draws nothing, so that it does not disturb the sequence.
    pub(crate) fn draw(self, random: &mut Rand64) -> Ns {
        if self.max <= self.min { self.min } else { random.rand_range(self.min..self.max.saturating_add(1)) }
    }
}
