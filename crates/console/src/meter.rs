//! How often each bus is asked, once a second.

use clino_bus::{Duration, Instant};
use clino_gateway::Bus;

use crate::host::Host;

/// From one look at the counters to the next.
const EVERY: Duration = Duration::from_millis(1_000);
/// Thousandths of a request per second in one per microsecond.
const PER_SECOND: u64 = 1_000_000_000;

/// Counts requests per second.
pub struct Meter {
    at: Instant,
    requests: [u32; Bus::COUNT],
    rates: [Option<u32>; Bus::COUNT],
}

impl Meter {
    /// Nothing was counted yet.
    pub const fn new() -> Meter {
        Meter { at: Instant::ZERO, requests: [0; Bus::COUNT], rates: [None; Bus::COUNT] }
    }

    /// Looks at the counters if a second has passed. Returns whether it has.
    pub fn tick(&mut self, host: &dyn Host) -> bool {
        let now = host.now();
        let passed = now.micros_since(self.at);
        if passed < EVERY.as_micros().into() {
            return false;
        }
        self.at = now;
        for ((bus, before), rate) in Bus::ALL.iter().zip(&mut self.requests).zip(&mut self.rates) {
            let Some(state) = &host.bus(*bus) else { continue };
            let requests = state.counters.requests;
            let asked = u64::from(requests.wrapping_sub(*before));
            *rate = asked.saturating_mul(PER_SECOND).checked_div(passed).map(|rate| rate as u32);
            *before = requests;
        }
        true
    }

    /// Requests in a second, in thousandths; `None` in the first second after reset.
    pub fn rate(&self, bus: Bus) -> Option<u32> {
        let place = Bus::ALL.iter().position(|other| *other == bus)?;
        self.rates.get(place).copied().flatten()
    }
}
