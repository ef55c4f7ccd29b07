//! The ISU's pulse-width output: captured timer ticks to an angle, in integers.
//!
//! Source: AN #201 §2 and §5.
//!
//! ```text
//!      ┌───────────┐                          ┌──
//!      │   high    │                          │      30 Hz; 4096 steps of 4.34 µs = 8 / 1.8432 MHz
//!    ──┘           └──────────────────────────┘      23.33 % at null, 50 % at 180°, 76.67 % at the top
//!      └────────────── period ────────────────┘
//! ```
//!
//! Angle and duty are ratios: the accuracy of the sensor's clock and of the timer cancels out.
//!
//! What this cannot see: no edges at all means stuck low or stuck high, which is for the capture to report.

use core::fmt;

use crate::angle::{Angle, Range};

/// Nominal frequency. Source: §5.
const NOMINAL_HZ: u32 = 30;
/// Parts per million.
const PPM: u32 = 1_000_000;

/// One captured cycle of the output, in ticks of one timer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Ticks {
    /// Rising edge to rising edge.
    pub period: u32,
    /// Rising edge to falling edge.
    pub high: u32,
}

impl Ticks {
    /// Duty cycle in parts per million, rounded half up; `None` for a period of zero, or a pulse longer than
    /// its period.
    pub const fn duty_ppm(self) -> Option<u32> {
        match self.ratio(PPM as i64, 0) {
            Some(ppm) => Some(ppm as u32),
            None => None,
        }
    }

    /// `factor · high/period + offset`, rounded half away from zero.
    ///
    /// `factor` is below 2^30 in magnitude: the product with a 32-bit count fits 62 bits.
    const fn ratio(self, factor: i64, offset: i64) -> Option<i64> {
        if self.period == 0 || self.high > self.period {
            return None;
        }
        let period = self.period as i64;
        let sum = factor * self.high as i64 + offset * period;
        let half = if sum < 0 { -(period / 2) } else { period / 2 };
        // For an odd period exact halves do not occur, so that rounding `period / 2` down is harmless.
        Some((sum + half) / period)
    }
}

/// The line from duty to angle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Law {
    /// `6.749 · duty[%] − 157.45`, as the document prints it. Exactly 180° at 50 %.
    #[default]
    Documented,
    /// `6.75 · duty[%] − 157.5`: what a counter of 7680 steps of 1/1.8432 MHz · 8 that rests for 1792 of them
    /// would do. The documented line is a rounding of it; they differ by at most 0.03°.
    Idealised,
}

impl Law {
    /// Micro-degrees per whole duty, and micro-degrees at zero duty.
    const fn line(self) -> (i64, i64) {
        match self {
            Self::Documented => (674_900_000, -157_450_000),
            Self::Idealised => (675_000_000, -157_500_000),
        }
    }

    /// The angle, not confined to a turn; `None` for ticks that are no cycle.
    ///
    /// ```
    /// use clino_codec::pwm::{Law, Ticks};
    ///
    /// let ticks = Ticks { period: 1_000, high: 366 };
    /// assert_eq!(Law::Documented.angle(ticks).unwrap().udeg(), 89_563_400);
    /// ```
    pub const fn angle(self, ticks: Ticks) -> Option<Angle> {
        let (factor, offset) = self.line();
        match ticks.ratio(factor, offset) {
            // Within −157.5°…517.5°.
            Some(udeg) => Some(Angle::from_udeg(udeg as i32)),
            None => None,
        }
    }
}

/// What a captured cycle has to satisfy.
///
/// The defaults of [`Limits::new`]:
///
/// | limit | value | why |
/// |---|---|---|
/// | period | 1/30 s ± 5 % | a resonator without trim, over temperature, with room: 28.6…31.5 Hz |
/// | duty | 23.33…76.67 % | the document's range |
/// | slack | 0.05 % (≈ 0.35°) | four of the sensor's steps of 130 ppm: one of its own at the seam between 360° and 0°, one for the rounding of the printed ends, doubled |
///
/// A duty within the slack is clamped to the end of the range, because around the seam a sensor that trembles
/// by a step may show either end. Beyond the slack it is a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Limits {
    /// Ticks per second of the timer.
    pub timer_hz: u32,
    /// Allowed deviation of the period from 1/30 s, in parts per million.
    pub period_tolerance_ppm: u32,
    /// Lowest duty in parts per million.
    pub min_duty_ppm: u32,
    /// Highest duty in parts per million.
    pub max_duty_ppm: u32,
    /// How far beyond either end a duty still counts as that end, in parts per million.
    pub slack_ppm: u32,
}

impl Limits {
    /// Default period tolerance: 5 %.
    pub const PERIOD_TOLERANCE_PPM: u32 = 50_000;
    /// Lowest duty, at null. Source: §5.
    pub const MIN_DUTY_PPM: u32 = 233_300;
    /// Highest duty, just below 360°: symmetric to the lowest around 50 % = 180°.
    pub const MAX_DUTY_PPM: u32 = 766_700;
    /// Default slack: four steps of 4.34 µs in 1/30 s, rounded down to 0.05 %.
    pub const SLACK_PPM: u32 = 500;

    /// The defaults for a timer of that rate.
    pub const fn new(timer_hz: u32) -> Self {
        Self {
            timer_hz,
            period_tolerance_ppm: Self::PERIOD_TOLERANCE_PPM,
            min_duty_ppm: Self::MIN_DUTY_PPM,
            max_duty_ppm: Self::MAX_DUTY_PPM,
            slack_ppm: Self::SLACK_PPM,
        }
    }

    /// The same for a timer whose own clock may be off by this much either way, in parts per million: the period may be off
    /// by both, (1 + sensor)·(1 + timer) − 1. Duty and angle are ratios: they stay as exact as they are.
    ///
    /// ```
    /// use clino_codec::pwm::Limits;
    ///
    /// // 1.05 · 1.08 = 1.134
    /// assert_eq!(Limits::new(84_000_000).with_clock_error(80_000).period_tolerance_ppm, 134_000);
    /// ```
    #[must_use]
    pub const fn with_clock_error(self, clock_ppm: u32) -> Self {
        let (sensor, timer) = (self.period_tolerance_ppm as u64, clock_ppm as u64);
        // Both below 2^32: the product fits, and is far from its end after the division.
        let both = sensor + timer + (sensor * timer).div_ceil(PPM as u64);
        let period_tolerance_ppm = if both < PPM as u64 { both as u32 } else { PPM };
        Self { period_tolerance_ppm, ..self }
    }

    /// Shortest and longest period in ticks.
    const fn periods(&self) -> (u32, u32) {
        let scale = NOMINAL_HZ as u64 * PPM as u64;
        let tolerance = if self.period_tolerance_ppm < PPM { self.period_tolerance_ppm } else { PPM } as u64;
        let shortest = self.timer_hz as u64 * (PPM as u64 - tolerance) / scale;
        let longest = (self.timer_hz as u64 * (PPM as u64 + tolerance)).div_ceil(scale);
        // At most 2/30 of a 32-bit number each.
        (shortest as u32, longest as u32)
    }
}

/// A valid cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PwmReading {
    /// 0° up to, not including, 360°, clockwise from the null position.
    pub angle: Angle,
    /// Duty as measured, in parts per million.
    pub duty_ppm: u32,
    /// The line gave an angle outside 0°…360°, and the nearer end was taken.
    pub clamped: bool,
}

/// Why a cycle is not valid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum PwmFault {
    /// The period is not that of an ISU.
    Period {
        /// Ticks.
        period: u32,
        /// Shortest period allowed, in ticks.
        shortest: u32,
        /// Longest period allowed, in ticks.
        longest: u32,
    },
    /// The pulse is longer than its period: an edge was lost.
    HighBeyondPeriod {
        /// The ticks.
        ticks: Ticks,
    },
    /// The pulse is too short.
    DutyBelow {
        /// Parts per million.
        duty_ppm: u32,
        /// Lowest duty allowed, slack included.
        min_ppm: u32,
    },
    /// The pulse is too long.
    DutyAbove {
        /// Parts per million.
        duty_ppm: u32,
        /// Highest duty allowed, slack included.
        max_ppm: u32,
    },
}

/// The angle of one captured cycle.
///
/// ```
/// use clino_codec::pwm::{Law, Limits, PwmFault, Ticks, measure};
///
/// let limits = Limits::new(84_000_000);
/// let half = measure(Ticks { period: 2_800_000, high: 1_400_000 }, &limits, Law::Documented).unwrap();
/// assert_eq!(half.angle.to_string(), "180.000");
///
/// let short = measure(Ticks { period: 2_800_000, high: 280_000 }, &limits, Law::Documented);
/// assert_eq!(short, Err(PwmFault::DutyBelow { duty_ppm: 100_000, min_ppm: 232_800 }));
/// ```
///
/// # Errors
/// Why the cycle is not one of an ISU, with what was seen and what is allowed.
pub fn measure(ticks: Ticks, limits: &Limits, law: Law) -> Result<PwmReading, PwmFault> {
    let (shortest, longest) = limits.periods();
    if ticks.period < shortest || ticks.period > longest {
        return Err(PwmFault::Period { period: ticks.period, shortest, longest });
    }
    let (Some(duty_ppm), Some(angle)) = (ticks.duty_ppm(), law.angle(ticks)) else {
        return Err(PwmFault::HighBeyondPeriod { ticks });
    };
    let min_ppm = limits.min_duty_ppm.saturating_sub(limits.slack_ppm);
    if duty_ppm < min_ppm {
        return Err(PwmFault::DutyBelow { duty_ppm, min_ppm });
    }
    let max_ppm = limits.max_duty_ppm.saturating_add(limits.slack_ppm);
    if duty_ppm > max_ppm {
        return Err(PwmFault::DutyAbove { duty_ppm, max_ppm });
    }
    let confined = angle.clamp(Angle::ZERO, Range::Unidirectional.last());
    Ok(PwmReading { angle: confined, duty_ppm, clamped: confined != angle })
}

impl fmt::Display for PwmFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Period { period, shortest, longest } => {
                write!(f, "period of {period} ticks is not in {shortest}..={longest}")
            }
            Self::HighBeyondPeriod { ticks: Ticks { period, high } } => {
                write!(f, "pulse of {high} ticks in a period of {period}")
            }
            Self::DutyBelow { duty_ppm, min_ppm } => write!(f, "duty of {duty_ppm} ppm is below {min_ppm}"),
            Self::DutyAbove { duty_ppm, max_ppm } => write!(f, "duty of {duty_ppm} ppm is above {max_ppm}"),
        }
    }
}

impl core::error::Error for PwmFault {}
