//! Values of a scenario file with their units: durations, angles, probabilities, frequencies.
//!
//! Each checks its own range, so that an error points at the value itself.

use std::fmt;
use std::marker::PhantomData;

use clino_sim::motion::DEGREE;
use clino_sim::node::Ns;
use serde::de::{self, Deserialize, Deserializer, Visitor};

use clino_segment::Probability;

use crate::oscillators::HSI_HZ;

/// Longest duration in a scenario: a day.
const LONGEST: Ns = 24 * 3_600 * 1_000_000_000;
/// Largest angle (and angular rate) in a scenario, in degrees (per second).
const LARGEST_DEGREES: f64 = 1e6;

/// A duration or an instant: a string of a number and a unit, `"5s"`, `"20ms"`, `"2.5us"`, `"100ns"`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Time(pub Ns);

/// Why a text is no duration.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BadTime(String);

impl fmt::Display for BadTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "`{}` is no duration, expected a number and a unit (s, ms, us, ns) such as \"5s\" or \"2.5ms\", \
             at most 24 hours, in whole nanoseconds",
            self.0
        )
    }
}

impl std::error::Error for BadTime {}

impl std::str::FromStr for Time {
    type Err = BadTime;

    fn from_str(text: &str) -> Result<Self, BadTime> {
        let bad = || BadTime(text.to_owned());
        let digits = text.find(|c: char| !c.is_ascii_digit() && c != '.').ok_or_else(bad)?;
        let (number, unit) = text.split_at(digits);
        let decimals = match unit {
            "s" => 9,
            "ms" => 6,
            "us" | "µs" => 3,
            "ns" => 0,
            _ => return Err(bad()),
        };
        let (whole, fraction) = number.split_once('.').unwrap_or((number, "0"));
        if whole.is_empty() || fraction.is_empty() || fraction.contains('.') {
            return Err(bad());
        }
        let fraction = fraction.trim_end_matches('0');
        if fraction.len() > decimals {
            return Err(bad());
        }
        let unit_ns = 10_u64.pow(decimals as u32);
        let fraction_ns = if fraction.is_empty() {
            0
        } else {
            fraction.parse::<Ns>().map_err(|_| bad())? * 10_u64.pow((decimals - fraction.len()) as u32)
        };
        let whole: Ns = whole.parse().map_err(|_| bad())?;
        let ns = whole.checked_mul(unit_ns).and_then(|ns| ns.checked_add(fraction_ns));
        ns.filter(|&ns| ns <= LONGEST).map(Time).ok_or_else(bad)
    }
}

impl fmt::Display for Time {
    /// In the largest unit that leaves no more than three decimals, or in nanoseconds.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ns = self.0;
        for (unit, name) in [(1_000_000_000, "s"), (1_000_000, "ms"), (1_000, "us")] {
            if ns >= unit && ns.is_multiple_of(unit / 1_000) {
                return write!(f, "{}{name}", ns as f64 / unit as f64);
            }
        }
        write!(f, "{ns}ns")
    }
}

impl<'de> Deserialize<'de> for Time {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Text;
        impl Visitor<'_> for Text {
            type Value = Time;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "a duration with its unit in quotes, such as \"5s\" or \"2.5ms\"")
            }

            fn visit_str<E: de::Error>(self, text: &str) -> Result<Time, E> {
                text.parse().map_err(E::custom)
            }
        }
        deserializer.deserialize_str(Text)
    }
}

/// A duration as the board counts it, for types that are read from a scenario as they are.
///
/// # Errors
/// It is no duration.
pub(crate) fn duration<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Ns, D::Error> {
    Time::deserialize(deserializer).map(|time| time.0)
}

/// A unit of plain numbers: what is allowed and what it becomes.
pub trait Unit {
    /// What the number becomes.
    type Value;
    /// What is expected, for messages.
    const EXPECTED: &'static str;
    /// The value, if the number is in range.
    fn convert(number: f64) -> Option<Self::Value>;
}

/// A number of a unit.
#[derive(Debug)]
pub struct Number<U: Unit>(pub U::Value);

impl<'de, U: Unit> Deserialize<'de> for Number<U> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Plain<U>(PhantomData<U>);
        impl<U: Unit> Visitor<'_> for Plain<U> {
            type Value = Number<U>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "{}", U::EXPECTED)
            }

            fn visit_f64<E: de::Error>(self, number: f64) -> Result<Self::Value, E> {
                let bad = || E::custom(format!("{number} is out of range, expected {}", U::EXPECTED));
                U::convert(number).map(Number).ok_or_else(bad)
            }

            fn visit_i64<E: de::Error>(self, number: i64) -> Result<Self::Value, E> {
                self.visit_f64(number as f64)
            }
        }
        deserializer.deserialize_f64(Plain(PhantomData))
    }
}

impl<U: Unit> Clone for Number<U>
where
    U::Value: Clone,
{
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

impl<U: Unit> Default for Number<U>
where
    U::Value: Default,
{
    fn default() -> Self {
        Self(U::Value::default())
    }
}

/// Degrees, or degrees per second, kept as micro-degrees.
#[derive(Debug)]
pub enum Degrees {}

impl Unit for Degrees {
    type Value = i64;
    const EXPECTED: &'static str = "degrees from -1000000 to 1000000";

    fn convert(number: f64) -> Option<i64> {
        (number.abs() <= LARGEST_DEGREES).then(|| (number * DEGREE as f64).round() as i64)
    }
}

/// A probability.
#[derive(Debug)]
pub enum Chances {}

impl Unit for Chances {
    type Value = Probability;
    const EXPECTED: &'static str = "a probability from 0 to 1";

    fn convert(number: f64) -> Option<Probability> {
        Probability::new(number)
    }
}

/// Hertz, kept as millihertz.
#[derive(Debug)]
pub enum Hertz {}

impl Unit for Hertz {
    type Value = u32;
    const EXPECTED: &'static str = "a frequency in Hz from 0.001 to 1000";

    fn convert(number: f64) -> Option<u32> {
        (0.001..=1_000.0).contains(&number).then(|| (number * 1_000.0).round() as u32)
    }
}

/// Relative error of the internal oscillator, kept as Hz: what DS8626 table 39 allows it over temperature.
#[derive(Debug)]
pub enum Deviation {}

impl Unit for Deviation {
    type Value = i32;
    const EXPECTED: &'static str = "a relative error from -0.08 to 0.045";

    fn convert(number: f64) -> Option<i32> {
        (-0.08..=0.045).contains(&number).then(|| (number * f64::from(HSI_HZ)).round() as i32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_are_read_exactly() {
        for (text, ns) in [
            ("5s", 5_000_000_000),
            ("0s", 0),
            ("20ms", 20_000_000),
            ("250us", 250_000),
            ("250µs", 250_000),
            ("7ns", 7),
            ("2.5us", 2_500),
            ("0.533333333s", 533_333_333),
            ("1.000ns", 1),
            ("86400s", 86_400_000_000_000),
        ] {
            assert_eq!(text.parse(), Ok(Time(ns)), "{text}");
        }
    }

    #[test]
    fn other_texts_are_no_durations() {
        for text in [
            "",
            "5",
            "s",
            "5 s",
            "5m",
            "-5s",
            "5.s",
            ".5s",
            "1.2.3s",
            "0.5ns",
            "1e3s",
            "86401s",
            "99999999999999999999s",
        ] {
            assert_eq!(text.parse::<Time>(), Err(BadTime(text.to_owned())), "{text}");
        }
    }

    #[test]
    fn durations_print_as_they_are_written() {
        for text in ["5s", "20ms", "250us", "7ns", "2.5us", "1.001s", "0ns"] {
            assert_eq!(text.parse::<Time>().unwrap().to_string(), text);
        }
    }

    #[test]
    fn numbers_are_scaled_and_bounded() {
        assert_eq!(Degrees::convert(-12.3456785), Some(-12_345_679));
        assert_eq!(Degrees::convert(1e6 + 1.0), None);
        assert_eq!(Degrees::convert(f64::NAN), None);
        assert_eq!(Hertz::convert(29.4), Some(29_400));
        assert_eq!(Hertz::convert(0.0), None);
    }
}
