//! What follows from single readings. Whole modules are in `gateway/tests/refresh.rs`.

use super::*;

const EXCHANGE: u64 = 7_000;

/// A tracker, and the angle that was read last.
#[derive(Default)]
struct Tracked {
    tracker: RefreshTracker,
    code: i32,
}

impl Tracked {
    fn read(&mut self, code: i32, asked: Instant, at: Instant) -> bool {
        let before = core::mem::replace(&mut self.code, code);
        self.tracker.read(code != before, asked, at)
    }

    fn next(&self, asked: Instant, period: Duration) -> Option<Instant> {
        self.tracker.next(asked, period)
    }
}

fn read(tracker: &mut Tracked, code: i32, at_ms: u64) -> bool {
    tracker.read(code, Instant::from_micros(at_ms * 1_000), Instant::from_micros(at_ms * 1_000 + EXCHANGE))
}

#[test]
fn the_first_reading_is_new_and_a_repetition_is_not() {
    let mut tracker = Tracked::default();
    assert!(read(&mut tracker, 5, 0));
    assert!(!read(&mut tracker, 5, 266));
    assert!(read(&mut tracker, 6, 532));
    assert!(!read(&mut tracker, 6, 600));
}

#[test]
fn an_equal_angle_is_new_when_a_refresh_has_passed_for_certain() {
    let mut tracker = Tracked::default();
    read(&mut tracker, 5, 0);
    assert!(!read(&mut tracker, 5, 520), "it may be the same one");
    // 533.3 ms and one per cent after the first answer.
    assert!(read(&mut tracker, 5, 546));
}

#[test]
fn two_readings_that_differ_narrow_the_instant() {
    let mut tracker = Tracked::default();
    read(&mut tracker, 5, 0);
    // It appears between 0 and 545.6 ms; the middle of that is asked.
    assert_eq!(
        tracker.next(Instant::from_micros(0), Duration::from_micros(533_000)),
        Some(Instant::from_micros(272_833))
    );
    read(&mut tracker, 5, 273);
    read(&mut tracker, 6, 410);
    // Between 273 and 417 ms, and a refresh later: between 801 and 956 ms, asked in the middle.
    let next = tracker.next(Instant::from_micros(410_000), Duration::from_micros(533_000)).unwrap();
    assert!((870_000..890_000).contains(&next.as_micros()), "{next:?}");
}

#[test]
fn the_period_is_the_longest_time_between_two_readings() {
    let mut tracker = Tracked::default();
    read(&mut tracker, 5, 0);
    for ms in [0_u32, 20, 100, 200] {
        assert_eq!(
            tracker.next(Instant::from_micros(0), Duration::from_millis(ms)),
            Some(Instant::from_millis(ms))
        );
    }
    // A module at rest is asked once in its shortest refresh, however long its period.
    let mut now = 0;
    for _ in 0..100 {
        let next =
            tracker.next(Instant::from_micros(now), Duration::from_micros(533_000)).unwrap().as_micros();
        assert!(next > now && next - now <= 552_000, "{now} to {next}");
        now = next;
        tracker.read(5, Instant::from_micros(now), Instant::from_micros(now + EXCHANGE));
    }
}

#[test]
fn one_asked_less_often_than_it_refreshes_is_not_followed() {
    let mut tracker = Tracked::default();
    assert_eq!(
        tracker.next(Instant::from_micros(0), Duration::from_micros(266_000)),
        None,
        "nothing was read"
    );
    read(&mut tracker, 5, 0);
    assert_eq!(tracker.next(Instant::from_micros(0), Duration::from_micros(534_000)), None);
}

/// However long nothing was read, the next angle is new: past 35.8 min and 71.6 min, at which counts of 32 bits turn,
/// 49.7 days, and a year.
#[test]
fn an_angle_after_a_long_silence_is_new() {
    for wait in [1 << 31, 1 << 32, 1_000 << 32, 365 * 86_400_000_000_u64, 1_200_000_000] {
        for wait in [wait - 300_000, wait - 1, wait, wait + 1, wait + 300_000] {
            let mut tracker = Tracked::default();
            assert!(tracker.read(5, Instant::from_micros(1_000_000), Instant::from_micros(1_007_000)));
            let asked = 1_000_000 + wait;
            assert!(
                tracker.read(5, Instant::from_micros(asked), Instant::from_micros(asked + EXCHANGE)),
                "the same code, {wait} us later"
            );
            assert!(!tracker.read(
                5,
                Instant::from_micros(asked + 100_000),
                Instant::from_micros(asked + 107_000)
            ));
        }
    }
}
