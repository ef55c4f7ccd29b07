//! Why an order is refused, with what was asked for and the limit that it breaks.

use clino_codec::t7;

use crate::config::Kind;
use crate::degraded::DegradedMode;

/// A number with its name and unit, in units of its last decimal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Number {
    /// What it is.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// How much.
    pub value: i64,
    /// Decimals that it is written with.
    pub decimals: u8,
}

/// Why an order is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// A number is out of its range.
    Range {
        /// What was asked for.
        number: Number,
        /// Smallest allowed, in units of its last decimal.
        least: i64,
        /// Largest allowed.
        most: i64,
    },
    /// A number is less than another that it has to fit.
    Shorter {
        /// What was asked for.
        number: Number,
        /// What it may not be less than.
        least: Number,
    },
    /// No sensor of this kind has this address.
    Address {
        /// The kind; [`Kind::Off`] stands for any.
        kind: Kind,
        /// What was asked for.
        value: i64,
    },
    /// What a change names of this setting, something else in the change excludes.
    Excluded(&'static str),
    /// This is none of the line's bit rates.
    BitRate {
        /// What was asked for, bit/s.
        value: u32,
        /// What it has, bit/s.
        allowed: &'static [u32],
    },
    /// A T7 does not accept this command or value.
    T7(t7::EncodeError),
    /// An ISU does not accept this command or value.
    Isu(clino_commissioning::isu::Cause),
    /// A task under way does not leave room for it: another task, or a change of what the task works on. Ask again.
    Busy,
    /// It is valid, but refused in the present degraded mode.
    Degraded(DegradedMode),
}
