//! Whether a sensor stands still, from a few readings of its angle.
//!
//! A zero is read back after it has been written. If the angle moves by more than the tolerance until then, the write
//! cannot succeed: it wears the memory for nothing. So the angle is watched for at least as long before, and nothing is
//! written unless all readings are within the tolerance of each other.

use clino_bus::{Duration, Instant};

const MICROS_PER_SECOND: u64 = 1_000_000;

/// Readings of an angle of which `TURN` units make a turn.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Motion<const TURN: i32> {
    last: i32,
    /// From the first reading to the last one, turns included.
    moved: i32,
    lowest: (i32, Instant),
    highest: (i32, Instant),
    readings: u8,
}

impl<const TURN: i32> Motion<TURN> {
    /// No reading yet.
    pub const fn new() -> Self {
        let first = (0, Instant::ZERO);
        Motion { last: 0, moved: 0, lowest: first, highest: first, readings: 0 }
    }

    /// Takes a reading. Between two of them the sensor has turned by less than half a turn.
    pub fn take(&mut self, angle: i32, at: Instant) {
        if self.readings == 0 {
            (self.lowest, self.highest) = ((0, at), (0, at));
        } else {
            self.moved = self.moved.saturating_add(step(angle, self.last, TURN));
        }
        self.last = angle;
        self.readings = self.readings.saturating_add(1);
        if self.moved < self.lowest.0 {
            self.lowest = (self.moved, at);
        }
        if self.moved > self.highest.0 {
            self.highest = (self.moved, at);
        }
    }

    /// Readings so far.
    pub const fn readings(&self) -> u8 {
        self.readings
    }

    /// From the lowest to the highest reading.
    pub const fn spread(&self) -> u32 {
        self.highest.0.abs_diff(self.lowest.0)
    }

    /// Between which instants the angle has gone from one to the other.
    pub const fn span(&self) -> Duration {
        let (low, high) = (self.lowest.1, self.highest.1);
        if low.as_micros() < high.as_micros() { high.since(low) } else { low.since(high) }
    }

    /// The spread in units a second, had it taken this long.
    pub const fn rate(&self, span: Duration) -> u32 {
        let scaled = (self.spread() as u64).saturating_mul(MICROS_PER_SECOND);
        match scaled.checked_div(span.as_micros() as u64) {
            Some(rate) if rate <= u32::MAX as u64 => rate as u32,
            _ => u32::MAX,
        }
    }
}

/// The shorter way from one angle to another.
const fn step(to: i32, from: i32, turn: i32) -> i32 {
    let way = to.wrapping_sub(from);
    let half = turn / 2;
    // Both are angles: no more than a turn and a half apart.
    let way = if way > half { way.wrapping_sub(turn) } else { way };
    if way < half.wrapping_neg() { way.wrapping_add(turn) } else { way }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn watch(readings: &[(i32, u64)]) -> Motion<360_000> {
        let mut motion = Motion::new();
        readings.iter().for_each(|&(angle, ms)| motion.take(angle, Instant::from_micros(ms * 1_000)));
        motion
    }

    #[test]
    fn a_steady_rate_is_told_across_the_seam() {
        // 20 degrees a second, upwards and downwards, in either output range.
        for readings in [
            [(179_000, 10), (-180_000, 60), (-178_000, 160)],
            [(1_000, 10), (0, 60), (358_000, 160)],
            [(358_000, 10), (359_000, 60), (1_000, 160)],
        ] {
            let motion = watch(&readings);
            assert_eq!((motion.spread(), motion.rate(motion.span())), (3_000, 20_000), "{readings:?}");
        }
    }

    #[test]
    fn a_vibration_is_its_widest_swing() {
        let motion = watch(&[(0, 0), (50, 10), (-70, 30), (20, 50)]);
        assert_eq!((motion.spread(), motion.rate(motion.span())), (120, 6_000));
        assert_eq!(watch(&[(5, 7)]).spread(), 0);
    }
}
