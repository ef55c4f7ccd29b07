//! PWM readings against the true edges: their error, and their delay after the first edge of their cycle.
//!
//! The angle of a cycle is the document's line, `6.749 * duty[%] - 157.45` (AN #201 section 5), in floating point
//! and written down here again, so that it shares nothing with the gateway's.

use clino_sim::motion::DEGREE;
use clino_sim::node::Ns;

use crate::pwm::Pulse;

/// A reading's cycle ended at most this long before its line began: two periods of the slowest signal the gateway
/// takes for an ISU's (28.5 Hz).
const RECENT: Ns = 70_000_000;
/// A reading tells of a cycle when it is this close to it, in micro-degrees: half the last decimal and rounding.
const SAME: f64 = 600.0;
const TURN: f64 = 360.0 * DEGREE as f64;

/// An angle that the console printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HeardAngle {
    /// First start bit of its line.
    pub began: Ns,
    /// End of its line.
    pub at: Ns,
    /// The angle in micro-degrees.
    pub angle: i64,
}

/// What the readings of one PWM input came to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Edges {
    /// Readings that tell of a cycle.
    pub readings: u64,
    /// Largest distance of a reading from the nearest recent cycle, in micro-degrees.
    pub max_error: f64,
    /// Longest time from the first edge of a reading's cycle to the end of its line.
    pub max_delay: Ns,
}

impl Edges {
    /// Compares the printed angles with the edges on the line.
    pub fn of(pulses: &[Pulse], heard: &[HeardAngle]) -> Edges {
        heard.iter().fold(Edges::default(), |mut edges, heard| {
            let until = pulses.partition_point(|pulse| pulse.next_rising <= heard.began);
            let recent = pulses.get(..until).unwrap_or_default().iter().rev();
            let recent = recent.take_while(|pulse| pulse.next_rising + RECENT >= heard.began);
            let distance = |pulse: &Pulse| {
                let distance = (angle(pulse) - heard.angle as f64).rem_euclid(TURN);
                distance.min(TURN - distance)
            };
            // The newest first: of two equal cycles, the reading tells of the later one.
            let told_of = recent.clone().find(|pulse| distance(pulse) <= SAME);
            if let Some(error) = recent.map(distance).min_by(f64::total_cmp) {
                edges.readings += 1;
                edges.max_error = edges.max_error.max(error);
            }
            if let Some(pulse) = told_of {
                edges.max_delay = edges.max_delay.max(heard.at - pulse.rising);
            }
            edges
        })
    }
}

/// The angle of a cycle in micro-degrees.
fn angle(pulse: &Pulse) -> f64 {
    let duty = (pulse.falling - pulse.rising) as f64 * 100.0 / (pulse.next_rising - pulse.rising) as f64;
    (6.749 * duty - 157.45) * DEGREE as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Ns = 1_000_000;

    /// 30 ms cycles, so that the numbers are round: 50 % is 180 degrees, 40 % is 112.51 degrees.
    fn pulse(n: u64, percent: u64) -> Pulse {
        let rising = n * 30 * MS;
        Pulse { rising, falling: rising + percent * 3 * MS / 10, next_rising: rising + 30 * MS }
    }

    #[test]
    fn a_reading_is_compared_with_the_cycle_it_tells_of() {
        let pulses = [pulse(0, 40), pulse(1, 50), pulse(2, 40)];
        let said = |angle| [HeardAngle { began: 65 * MS, at: 73 * MS, angle }];
        let right = Edges::of(&pulses, &said(180_000_400));
        assert_eq!((right.readings, right.max_error.round() as i64), (1, 400));
        // The cycle of 180 degrees began at 30 ms; the one after it was not over yet.
        assert_eq!(right.max_delay, 43 * MS);
        assert_eq!(Edges::of(&pulses, &said(112_510_000)).max_delay, 73 * MS);
        assert_eq!(Edges::of(&pulses, &said(181_000_000)).max_error.round() as i64, 1_000_000);
    }

    #[test]
    fn a_reading_of_a_cycle_long_past_has_nothing_to_be_compared_with() {
        let late = [HeardAngle { began: 200 * MS, at: 210 * MS, angle: 180_000_000 }];
        assert_eq!(Edges::of(&[pulse(0, 50)], &late), Edges::default());
    }
}
