//! The PWM output of the STT ISU.
//!
//! Source: "Interfacing to an ISU Module", section 5. About 30 Hz, 4.34 µs a step, `Angle = 6.749 · duty[%] −
//! 157.45°`, 0 … 360° from the null position. Here the printed law is inverted: the high time is the one that
//! the law turns back into the true angle. (The document's other figures, 23.33 % at null and 50 % at +180°,
//! agree with it to 0.01°.)
//!
//! 30 Hz and 4.34 µs = 8 / 1.8432 MHz give 7680 steps a period; period and step come from the same clock, so
//! an off-frequency module has longer or shorter steps and still 7680 of them.

use crate::motion::{self, Motion};
use crate::node::Ns;
use crate::said::{Record, Said};

/// Micro-degrees that the law gives per unit of duty (duty 0 … 1): 6.749° per percent.
const LAW_SPAN: i128 = 674_900_000;

/// Micro-degrees that the law subtracts: 157.45°.
const LAW_OFFSET: i128 = 157_450_000;

/// Steps of 4.34 µs in one period at 30 Hz.
const STEPS: i128 = 7680;

/// Nanoseconds per second times millihertz per hertz.
const NS_MILLIHERTZ: u64 = 1_000_000_000_000;

/// Longest wait before a stuck output is looked at again.
const LONGEST_STUCK_WAIT: Ns = 1_000_000_000;

/// What the output does from a given instant on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cycle {
    /// High for `high`, then low until `period` is over; both in nanoseconds from the rising edge.
    Pulse {
        /// Rising edge to rising edge.
        period: Ns,
        /// Rising edge to falling edge.
        high: Ns,
    },
    /// No edge: the output stands at one level.
    Level {
        /// The level.
        high: bool,
        /// Ask again after this many nanoseconds (never 0).
        recheck_after: Ns,
    },
}

/// The output stands at one level from `from` until just before `until`. It takes hold at the first cycle
/// that would begin inside the interval: a pulse under way is finished.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stuck {
    /// First instant.
    pub from: Ns,
    /// First instant after.
    pub until: Ns,
    /// Level at which it stands.
    pub high: bool,
}

/// How finely the module sets the high time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantisation {
    /// To the nearest of 7680 steps a period, as the module does. Half a step is 0.044°.
    Steps,
    /// To the nearest nanosecond, for comparison of edges with angles. Half of one is 0.00001°.
    Ideal,
}

/// A PWM output.
#[derive(Clone, Debug)]
pub struct Pwm {
    /// The true angle relative to the null position.
    pub motion: Motion,
    /// Frequency in millihertz: 30 000 nominal. 0 never pulses.
    pub frequency_millihertz: u32,
    /// How finely the high time is set.
    pub quantisation: Quantisation,
    /// Intervals without edges; the first that holds an instant decides.
    pub stuck: Vec<Stuck>,
    said: Record,
}

impl Pwm {
    /// Nominal frequency in millihertz.
    pub const NOMINAL_MILLIHERTZ: u32 = 30_000;

    /// An output at the nominal 30 Hz, quantised like the module's, never stuck.
    #[must_use]
    pub fn new(motion: Motion) -> Self {
        Self {
            motion,
            frequency_millihertz: Self::NOMINAL_MILLIHERTZ,
            quantisation: Quantisation::Steps,
            stuck: Vec::new(),
            said: Record::default(),
        }
    }

    /// What the output does from `rising_at` on. The angle is taken at that instant.
    pub fn next_cycle(&mut self, rising_at: Ns) -> Cycle {
        if let Some(stuck) = self.stuck.iter().find(|s| (s.from..s.until).contains(&rising_at)) {
            return Cycle::Level { high: stuck.high, recheck_after: stuck.until - rising_at };
        }
        let Some(period) = NS_MILLIHERTZ.checked_div(u64::from(self.frequency_millihertz)) else {
            return Cycle::Level { high: false, recheck_after: LONGEST_STUCK_WAIT };
        };
        let angle = i128::from(motion::unidirectional(self.motion.at(rising_at)));
        let high = high_time(angle, i128::from(period), self.quantisation);
        self.said.push(Said {
            at: rising_at,
            sampled_at: rising_at,
            axis: 0,
            microdegrees: law(high, i128::from(period)),
        });
        Cycle::Pulse { period, high: high as Ns }
    }

    /// Angles that the edges stand for by the printed law, not reduced to 0 … 360°.
    #[must_use]
    pub fn said(&self) -> &Record {
        &self.said
    }
}

/// High time in nanoseconds for an angle of 0 ≤ `angle` < 360° in µ°.
fn high_time(angle: i128, period: i128, quantisation: Quantisation) -> i128 {
    let duty = angle + LAW_OFFSET;
    match quantisation {
        Quantisation::Ideal => rounded(duty * period, LAW_SPAN),
        Quantisation::Steps => rounded(rounded(duty * STEPS, LAW_SPAN) * period, STEPS),
    }
}

/// The printed law: angle in µ° for the two times of a pulse.
fn law(high: i128, period: i128) -> i64 {
    rounded(LAW_SPAN * high - LAW_OFFSET * period, period) as i64
}

/// Quotient rounded to nearest, halves up; `divisor` is positive.
fn rounded(dividend: i128, divisor: i128) -> i128 {
    (2 * dividend + divisor).div_euclid(2 * divisor)
}
