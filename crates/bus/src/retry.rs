//! Whether and when to repeat a request that failed.
//!
//! A request that only reads is repeated after every fault: asking twice does no harm. A request that changes a
//! sensor's non-volatile memory may have been carried out although no answer came, and memory wears; it is repeated
//! only if it certainly was not heard. Anything more (reading back, then writing what differs) is for callers that know
//! what they want to write.

use crate::{Duration, Fault, Instant};

/// How often and how soon to repeat.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Retry {
    /// Further tries after the first.
    pub times: u8,
    /// Least time from a failure to the next try. The master's own wait for a late answer
    /// ([`Master::ask_at`](crate::Master::ask_at)) comes on top, if it is longer.
    pub pause: Duration,
}

impl Retry {
    /// No second try.
    pub const NEVER: Retry = Retry { times: 0, pause: Duration::ZERO };

    /// This many further tries, each as soon as the master allows.
    pub const fn times(times: u8) -> Retry {
        Retry { times, pause: Duration::ZERO }
    }

    /// The last of `tried` tries failed with `fault` at `at`, of a request that `writes` to non-volatile memory or not: from
    /// when on to [try again](crate::Master::begin_retry), or `None` for never.
    pub fn after<E>(&self, tried: u8, writes: bool, fault: &Fault<E>, at: Instant) -> Option<Instant> {
        let harmless = !writes || fault.request_unheard();
        let again = harmless && tried <= self.times && !matches!(fault, Fault::Over { .. });
        again.then(|| at + self.pause)
    }
}

#[cfg(test)]
mod tests;
