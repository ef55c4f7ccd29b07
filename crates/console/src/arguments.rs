//! Words with a meaning of their own. A word that is none of them is refused with the list of those that are.

use clino_bus::line::EchoMode;
use clino_codec::angle::Range;
use clino_codec::t7::Direction;
use clino_gateway::Bus;
use embedded_cli::arguments::{FromArgument, FromArgumentError};

/// A type whose values are words.
trait Words: Sized + Copy + 'static {
    const EXPECTED: &'static str;
    const WORDS: &'static [(&'static str, Self)];
}

fn find<W: Words>(word: &str) -> Result<W, FromArgumentError<'_>> {
    let found = W::WORDS.iter().find(|(name, _)| *name == word);
    found.map(|(_, value)| *value).ok_or(FromArgumentError { value: word, expected: W::EXPECTED })
}

macro_rules! words {
    ($($type:ty),*) => {$(
        impl<'a> FromArgument<'a> for $type {
            fn from_arg(word: &'a str) -> Result<Self, FromArgumentError<'a>> {
                find(word)
            }
        }
    )*};
}

words!(Switch, Kind, BusName, Echo, Sense, OutputRange, T7Verb, IsuVerb);

/// On or off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Switch(pub bool);

impl Words for Switch {
    const EXPECTED: &'static str = "on or off";
    const WORDS: &'static [(&'static str, Self)] = &[("on", Switch(true)), ("off", Switch(false))];
}

/// What a slot reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A T7.
    T7,
    /// An ISU.
    Isu,
    /// A PWM input.
    Pwm,
    /// Nothing.
    Off,
}

impl Words for Kind {
    const EXPECTED: &'static str = "t7, isu, pwm or off";
    const WORDS: &'static [(&'static str, Self)] =
        &[("t7", Kind::T7), ("isu", Kind::Isu), ("pwm", Kind::Pwm), ("off", Kind::Off)];
}

/// A bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BusName(pub Bus);

impl Words for BusName {
    const EXPECTED: &'static str = "t7 or isu";
    const WORDS: &'static [(&'static str, Self)] = &[("t7", BusName(Bus::T7)), ("isu", BusName(Bus::Isu))];
}

/// Whether our own characters come back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Echo(pub EchoMode);

impl Words for Echo {
    const EXPECTED: &'static str = "off, expected or detect";
    const WORDS: &'static [(&'static str, Self)] = &[
        ("off", Echo(EchoMode::Off)),
        ("expected", Echo(EchoMode::Expected)),
        ("detect", Echo(EchoMode::Detect)),
    ];
}

/// What is to be done with T7s.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum T7Verb {
    Scan,
    Info,
    Zero,
    Offset,
    Direction,
    Damping,
    Range,
    Address,
    Baud,
}

impl Words for T7Verb {
    const EXPECTED: &'static str = "scan, info, zero, offset, direction, damping, range, address or baud";
    const WORDS: &'static [(&'static str, Self)] = &[
        ("scan", T7Verb::Scan),
        ("info", T7Verb::Info),
        ("zero", T7Verb::Zero),
        ("offset", T7Verb::Offset),
        ("direction", T7Verb::Direction),
        ("damping", T7Verb::Damping),
        ("range", T7Verb::Range),
        ("address", T7Verb::Address),
        ("baud", T7Verb::Baud),
    ];
}

/// What is to be done with ISUs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IsuVerb {
    Info,
    Reset,
    Zero,
    Null,
    Address,
    Repair,
}

impl Words for IsuVerb {
    const EXPECTED: &'static str = "info, reset, zero, null, address or repair";
    const WORDS: &'static [(&'static str, Self)] = &[
        ("info", IsuVerb::Info),
        ("reset", IsuVerb::Reset),
        ("zero", IsuVerb::Zero),
        ("null", IsuVerb::Null),
        ("address", IsuVerb::Address),
        ("repair", IsuVerb::Repair),
    ];
}

/// Sense of rotation of a T7's axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sense(pub Direction);

impl Words for Sense {
    const EXPECTED: &'static str = "normal or reversed";
    const WORDS: &'static [(&'static str, Self)] =
        &[("normal", Sense(Direction::Normal)), ("reversed", Sense(Direction::Reversed))];
}

/// Output range of a T7.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OutputRange(pub Range);

impl Words for OutputRange {
    const EXPECTED: &'static str = "bidirectional or unidirectional";
    const WORDS: &'static [(&'static str, Self)] = &[
        ("bidirectional", OutputRange(Range::Bidirectional)),
        ("unidirectional", OutputRange(Range::Unidirectional)),
    ];
}
