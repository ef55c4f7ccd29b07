//! Wall clock: milliseconds since 1970, UTC. It may jump; what is measured with it is only ever published, never subtracted.
//!
//! A jump is noticed by comparing it with the clock that does not ([`JumpWatch`]), and told.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use serde::Serialize;

/// An instant of the wall clock, in milliseconds since 1970, UTC.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct Wall(pub i64);

impl Wall {
    /// Now.
    pub fn now() -> Wall {
        Wall::of(SystemTime::now())
    }

    fn of(time: SystemTime) -> Wall {
        let ms = |span: Duration| i64::try_from(span.as_millis()).unwrap_or(i64::MAX);
        Wall(match time.duration_since(UNIX_EPOCH) {
            Ok(after) => ms(after),
            Err(before) => -ms(before.duration()),
        })
    }

    /// Earlier by this many milliseconds.
    pub fn minus_ms(self, ms: u64) -> Wall {
        Wall(self.0.saturating_sub(i64::try_from(ms).unwrap_or(i64::MAX)))
    }

    /// As RFC 3339 writes it, if it is after 1970.
    pub fn rfc3339(self) -> Option<String> {
        let since = Duration::from_millis(u64::try_from(self.0).ok()?);
        Some(humantime::format_rfc3339_millis(UNIX_EPOCH + since).to_string())
    }
}

/// A jump that is told: larger than what NTP slews and what a loaded machine delays.
const JUMP_MS: i64 = 1_000;

/// Compares the wall clock with the clock that does not jump.
pub struct JumpWatch {
    at: Instant,
    wall: Wall,
}

impl JumpWatch {
    pub fn new() -> JumpWatch {
        JumpWatch { at: Instant::now(), wall: Wall::now() }
    }

    /// By how much the wall clock has jumped since the last look, in milliseconds, if it has.
    pub fn look(&mut self, at: Instant, wall: Wall) -> Option<i64> {
        let passed = i64::try_from(at.saturating_duration_since(self.at).as_millis()).unwrap_or(i64::MAX);
        let jump = wall.0.saturating_sub(self.wall.0).saturating_sub(passed);
        *self = JumpWatch { at, wall };
        (jump.abs() > JUMP_MS).then_some(jump)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected values from `date -u -d @SECONDS +%FT%T`.
    #[test]
    fn instants_are_written_as_date_writes_them() {
        for (ms, text) in [
            (0, "1970-01-01T00:00:00.000Z"),
            (951_782_400_123, "2000-02-29T00:00:00.123Z"),
            (1_796_000_000_000, "2026-11-30T00:53:20.000Z"),
            (4_107_542_399_999, "2100-02-28T23:59:59.999Z"),
            (4_107_542_400_000, "2100-03-01T00:00:00.000Z"),
        ] {
            assert_eq!(Wall(ms).rfc3339().as_deref(), Some(text));
        }
        assert_eq!(Wall(-1).rfc3339(), None);
    }

    #[test]
    fn a_jump_is_noticed_once_both_ways_and_no_delay_is_one() {
        let mut watch = JumpWatch::new();
        let (at, wall) = (watch.at, watch.wall);
        let after = |s: u64| at + Duration::from_secs(s);
        assert_eq!(watch.look(after(100), Wall(wall.0 + 100_900)), None);
        assert_eq!(watch.look(after(101), Wall(wall.0 + 3_701_900)), Some(3_600_000));
        assert_eq!(watch.look(after(102), Wall(wall.0 + 3_702_900)), None);
        assert_eq!(watch.look(after(103), Wall(wall.0 + 103_000)), Some(-3_600_900));
    }
}
