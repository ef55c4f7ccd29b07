//! Words with a meaning of their own. One table says what each means and how each is printed; a word that is none of
//! them is refused with the list of those that are.

use clino_codec::angle::Range;
use clino_codec::t7::Direction;
use clino_gateway::Bus;
use clino_gateway::config::Kind;

/// A type whose values are words.
pub trait Words: Sized + Copy + PartialEq + 'static {
    /// The words.
    const NAMES: &'static [&'static str];
    /// What they mean, in the same order.
    const VALUES: &'static [Self];

    /// The word for it.
    fn name(self) -> &'static str {
        let place = Self::VALUES.iter().position(|value| *value == self);
        place.and_then(|place| Self::NAMES.get(place)).copied().unwrap_or("")
    }
}

impl Words for bool {
    const NAMES: &'static [&'static str] = &["on", "off", "yes", "no"];
    const VALUES: &'static [Self] = &[true, false, true, false];
}

impl Words for Kind {
    const NAMES: &'static [&'static str] = Kind::NAMES;
    const VALUES: &'static [Self] = &Kind::ALL;
}

impl Words for Bus {
    const NAMES: &'static [&'static str] = &[
        Bus::T7.name(),
        #[cfg(feature = "isu")]
        Bus::Isu.name(),
    ];
    const VALUES: &'static [Self] = &Bus::ALL;
}

impl Words for Direction {
    const NAMES: &'static [&'static str] = &["normal", "reversed"];
    const VALUES: &'static [Self] = &[Direction::Normal, Direction::Reversed];
}

impl Words for Range {
    const NAMES: &'static [&'static str] = &["bidirectional", "unidirectional"];
    const VALUES: &'static [Self] = &[Range::Bidirectional, Range::Unidirectional];
}

/// Commissioning commands of T7s.
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
    const NAMES: &'static [&'static str] =
        &["scan", "info", "zero", "offset", "direction", "damping", "range", "address", "baud"];
    const VALUES: &'static [Self] = &[
        T7Verb::Scan,
        T7Verb::Info,
        T7Verb::Zero,
        T7Verb::Offset,
        T7Verb::Direction,
        T7Verb::Damping,
        T7Verb::Range,
        T7Verb::Address,
        T7Verb::Baud,
    ];
}

/// Commissioning commands of ISUs.
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
    const NAMES: &'static [&'static str] = &["info", "reset", "zero", "null", "address", "repair"];
    const VALUES: &'static [Self] =
        &[IsuVerb::Info, IsuVerb::Reset, IsuVerb::Zero, IsuVerb::Null, IsuVerb::Address, IsuVerb::Repair];
}
