//! The plots' memory: of each sensor a day, in rings of a fixed size.
//!
//! | ring | interval | intervals | reaches back |
//! |---|---|---|---|
//! | 0 | 100 ms | 600 | a minute |
//! | 1 | 1 s | 3600 | an hour |
//! | 2 | 1 min | 1440 | a day |
//!
//! An interval keeps the lowest and the highest angle in it: a short swing is in the plot of a whole day. An interval in which
//! there was no value is empty, and so is its place in the plot. 90 kB a sensor.

use std::time::{Duration, Instant};

use clino_codec::angle::Angle;

/// Lengths of the intervals, and how many of them there are.
const RINGS: [(Duration, usize); 3] =
    [(Duration::from_millis(100), 600), (Duration::from_secs(1), 3_600), (Duration::from_secs(60), 1_440)];

/// Lowest and highest angle of an interval.
pub type Extent = Option<(Angle, Angle)>;

/// The memory of one sensor.
pub struct History {
    since: Instant,
    rings: [Ring; 3],
}

struct Ring {
    interval: Duration,
    extents: Box<[Extent]>,
    /// Number of the interval that was written last, counted from `since`.
    last: u64,
}

/// A part of the memory: extents one after the other.
#[derive(Debug, PartialEq, Eq)]
pub struct Span {
    /// Length of an interval.
    pub interval: Duration,
    /// How long before `now` the first interval began.
    pub back: Duration,
    /// The oldest first.
    pub extents: Vec<Extent>,
}

impl Ring {
    fn advance(&mut self, number: u64) {
        let length = self.extents.len() as u64;
        let from = (self.last + 1).max(number.saturating_sub(length - 1));
        for empty in from..=number {
            if let Some(extent) = self.extents.get_mut((empty % length) as usize) {
                *extent = None;
            }
        }
        self.last = self.last.max(number);
    }

    fn add(&mut self, at: Duration, angle: Angle) {
        let number = interval_number(at, self.interval);
        let length = self.extents.len() as u64;
        self.advance(number);
        if number + length <= self.last {
            return;
        }
        if let Some(extent) = self.extents.get_mut((number % length) as usize) {
            *extent = Some(extent.map_or((angle, angle), |(low, high)| (low.min(angle), high.max(angle))));
        }
    }
}

fn interval_number(at: Duration, interval: Duration) -> u64 {
    u64::try_from(at.as_millis() / interval.as_millis()).unwrap_or(u64::MAX)
}

impl History {
    /// An empty one, from now on.
    pub fn new(since: Instant) -> History {
        let ring = |(interval, length): (Duration, usize)| Ring {
            interval,
            extents: vec![None; length].into(),
            last: 0,
        };
        History { since, rings: RINGS.map(ring) }
    }

    /// An angle that was measured at this instant.
    pub fn add(&mut self, measured: Instant, angle: Angle) {
        let Some(at) = measured.checked_duration_since(self.since) else { return };
        for ring in &mut self.rings {
            ring.add(at, angle);
        }
    }

    /// The last `span`, from the finest ring that reaches back as far.
    pub fn last(&mut self, span: Duration, now: Instant) -> Span {
        let at = now.saturating_duration_since(self.since);
        let reaches =
            |ring: &Ring| ring.interval * u32::try_from(ring.extents.len()).unwrap_or(u32::MAX) >= span;
        let index = self.rings.iter().position(reaches).unwrap_or(self.rings.len() - 1);
        let Some(ring) = self.rings.get_mut(index) else {
            return Span { interval: span, back: span, extents: Vec::new() };
        };
        let end = interval_number(at, ring.interval);
        ring.advance(end);
        let length = ring.extents.len() as u64;
        let wanted = interval_number(span, ring.interval).clamp(1, length);
        let first = (end + 1).saturating_sub(wanted);
        let extents =
            (first..=end).map(|number| ring.extents.get((number % length) as usize).copied().flatten());
        let began = ring.interval * u32::try_from(first).unwrap_or(u32::MAX);
        Span { interval: ring.interval, back: at.saturating_sub(began), extents: extents.collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(mdeg: i32) -> Angle {
        Angle::from_mdeg(mdeg).expect("within its range")
    }

    const SECOND: Duration = Duration::from_secs(1);

    #[test]
    fn a_short_swing_is_in_the_plot_of_a_day() {
        let since = Instant::now();
        let mut history = History::new(since);
        for second in 0..7_200_u32 {
            history.add(since + SECOND * second, at(100));
        }
        history.add(since + SECOND * 3_600 + SECOND / 2, at(9_000));
        let day = history.last(SECOND * 86_400, since + SECOND * 7_199);
        assert_eq!(day.extents.len(), 120);
        assert_eq!(day.extents[60], Some((at(100), at(9_000))));
        assert_eq!(day.extents[59], Some((at(100), at(100))));
        assert_eq!(day.back, SECOND * 7_199);
    }

    #[test]
    fn where_there_was_no_value_there_is_none() {
        let since = Instant::now();
        let mut history = History::new(since);
        history.add(since + SECOND * 10, at(1));
        history.add(since + SECOND * 40, at(-2));
        let minute = history.last(SECOND * 60, since + SECOND * 50);
        let there: Vec<_> =
            minute.extents.iter().enumerate().filter_map(|(n, extent)| Some((n, (*extent)?))).collect();
        assert_eq!(there, [(100, (at(1), at(1))), (400, (at(-2), at(-2)))]);
    }

    #[test]
    fn what_is_older_than_a_ring_is_forgotten_in_it_and_no_value_appears_twice() {
        let since = Instant::now();
        let mut history = History::new(since);
        history.add(since, at(7));
        assert!(history.last(SECOND * 60, since + SECOND * 61).extents.iter().all(Option::is_none));
        assert_eq!(history.last(SECOND * 3_600, since + SECOND * 61).extents[0], Some((at(7), at(7))));
        // Long silence: nothing of the old turn of the ring is left.
        assert!(
            history.last(SECOND * 86_400, since + SECOND * 86_400 * 3).extents.iter().all(Option::is_none)
        );
    }

    #[test]
    fn a_value_that_comes_late_is_put_where_it_was_measured() {
        let since = Instant::now();
        let mut history = History::new(since);
        history.add(since + SECOND * 30, at(1));
        history.add(since + SECOND * 20, at(2));
        history.add(since + SECOND * 20, at(4));
        let minute = history.last(SECOND * 60, since + SECOND * 30);
        assert_eq!((minute.extents[200], minute.extents[300]), (Some((at(2), at(4))), Some((at(1), at(1)))));
    }
}
