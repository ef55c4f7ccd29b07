//! Collects the values of a gateway that come close to each other, for one message.
//!
//! Of a sensor that has two outcomes within a batch, both are in it: nothing is left out of the history.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// The batches of all gateways.
pub struct Batches {
    collect: Duration,
    values: Vec<Vec<String>>,
    /// Gateways with values, the earliest first: all wait equally long.
    due: VecDeque<(Instant, usize)>,
}

impl Batches {
    /// For this many gateways.
    pub fn new(gateways: usize, collect: Duration) -> Batches {
        Batches { collect, values: vec![Vec::new(); gateways], due: VecDeque::new() }
    }

    /// Adds a value.
    pub fn add(&mut self, gateway: usize, value: String, now: Instant) {
        let Some(values) = self.values.get_mut(gateway) else { return };
        if values.is_empty() {
            self.due.push_back((now + self.collect, gateway));
        }
        values.push(value);
    }

    /// When the next batch is due.
    pub fn due(&self) -> Option<Instant> {
        self.due.front().map(|(at, _)| *at)
    }

    /// The values of a gateway whose batch is due.
    pub fn take_due(&mut self, now: Instant) -> Option<(usize, Vec<String>)> {
        let (at, gateway) = *self.due.front()?;
        if at > now {
            return None;
        }
        self.due.pop_front();
        Some((gateway, std::mem::take(self.values.get_mut(gateway)?)))
    }

    /// The values of this gateway, due or not: something about it has to come after them.
    pub fn take(&mut self, gateway: usize) -> Option<Vec<String>> {
        let values = std::mem::take(self.values.get_mut(gateway)?);
        self.due.retain(|(_, other)| *other != gateway);
        (!values.is_empty()).then_some(values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_that_come_together_go_together_and_in_time() {
        let mut batches = Batches::new(2, Duration::from_millis(20));
        let at = Instant::now();
        let ms = Duration::from_millis;
        batches.add(0, "a".into(), at);
        batches.add(1, "b".into(), at + ms(5));
        batches.add(0, "c".into(), at + ms(19));
        assert_eq!(batches.due(), Some(at + ms(20)));
        assert_eq!(batches.take_due(at + ms(19)), None);
        assert_eq!(batches.take_due(at + ms(20)), Some((0, vec!["a".into(), "c".into()])));
        assert_eq!(batches.take_due(at + ms(20)), None);
        assert_eq!(batches.take(1), Some(vec!["b".into()]));
        assert_eq!((batches.take(1), batches.due()), (None, None));
    }
}
