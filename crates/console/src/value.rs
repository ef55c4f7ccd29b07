//! A value of an answer: how it is written for people, and in JSON.

use core::fmt::{self, Display, Write};

use clino_codec::angle::Angle;
use clino_gateway::summary::Signals;
use clino_gateway::{Health, Published};

use crate::audience::Audience;
use crate::plain::Plain;

/// Thousandths of a degree: what a T7 resolves.
pub const DECIMALS: usize = 3;

/// A value of an answer.
#[derive(Clone, Copy)]
pub enum Value<'a> {
    /// A number.
    Number(i64),
    /// A number with three decimals, in thousandths.
    Thousandths(i64),
    /// A number with this number of decimals, in units of the last one.
    Decimal(i64, u8),
    /// A name with its unit.
    Label(Label),
    /// An angle, in degrees.
    Angle(Angle),
    /// A word, or a few.
    Text(&'a str),
    /// A name that a person has given: may be empty, or have any printable character.
    Quoted(&'a str),
    /// Something that writes itself in words.
    Words(&'a dyn Display),
    /// Words, one of which is expected.
    OneOf(&'static [&'static str]),
    /// Yes or no.
    Flag(bool),
    /// An address, or bits: eight hexadecimal digits.
    Hex(u32),
    /// Signals of a slot.
    Health(Health),
    /// Signals of the gateway.
    Signals(Signals),
    /// There is none.
    None,
}

macro_rules! numbers {
    ($($type:ty),*) => {$(
        impl From<$type> for Value<'_> {
            fn from(number: $type) -> Self {
                Value::Number(number.into())
            }
        }
    )*};
}

numbers!(u8, u16, u32, i32, i64);

impl From<u64> for Value<'_> {
    fn from(number: u64) -> Self {
        Value::Number(i64::try_from(number).unwrap_or(i64::MAX))
    }
}

impl From<Angle> for Value<'_> {
    fn from(angle: Angle) -> Self {
        Value::Angle(angle)
    }
}

impl From<Published> for Value<'_> {
    fn from(angle: Published) -> Self {
        Value::Angle(angle.angle())
    }
}

impl<'a> From<&'a str> for Value<'a> {
    fn from(text: &'a str) -> Self {
        Value::Text(text)
    }
}

impl<'a, T: Into<Value<'a>>> From<Option<T>> for Value<'a> {
    fn from(value: Option<T>) -> Self {
        value.map_or(Value::None, Into::into)
    }
}

impl Value<'_> {
    /// Writes it; in JSON words stand in quotes.
    pub fn write(self, out: &mut dyn Write, audience: Audience) -> fmt::Result {
        let programs = audience == Audience::Programs;
        let quote = if programs { "\"" } else { "" };
        match self {
            Value::Number(number) => write!(out, "{number}"),
            Value::Thousandths(number) => decimal(out, number, THOUSANDTHS),
            Value::Decimal(number, decimals) => decimal(out, number, decimals),
            Value::Label(label) => write!(out, "{quote}{label}{quote}"),
            Value::Angle(angle) => out.write_str(angle.text(DECIMALS).as_str()),
            Value::Quoted(text) => {
                out.write_char('"')?;
                for character in text.chars() {
                    if programs && matches!(character, '"' | '\\') {
                        out.write_char('\\')?;
                    }
                    out.write_char(character)?;
                }
                out.write_char('"')
            }
            Value::Text(text) => write!(out, "{quote}{}{quote}", Plain(&text)),
            Value::Words(words) => write!(out, "{quote}{}{quote}", Plain(words)),
            Value::OneOf(words) => {
                out.write_str(quote)?;
                one_of(out, words)?;
                out.write_str(quote)
            }
            Value::Flag(flag) => out.write_str(match (programs, flag) {
                (false, true) => "yes",
                (false, false) => "no",
                (true, true) => "true",
                (true, false) => "false",
            }),
            Value::Hex(bits) => write!(out, "{quote}{bits:#010x}{quote}"),
            Value::Health(health) => names(out, programs, &mut health.names()),
            Value::Signals(signals) => names(out, programs, &mut signals.names()),
            Value::None => out.write_str(if programs { "null" } else { "none" }),
        }
    }
}

/// Names of signals, or that there are none.
fn names(out: &mut dyn Write, programs: bool, names: &mut dyn Iterator<Item = &'static str>) -> fmt::Result {
    let (begin, between, end, none) = if programs { ("[", ",", "]", "[") } else { ("", " ", "", "well") };
    let quote = if programs { "\"" } else { "" };
    let mut before = begin;
    for name in names {
        write!(out, "{before}{quote}{name}{quote}")?;
        before = between;
    }
    // Nothing stands behind the beginning.
    out.write_str(if before == begin { none } else { "" })?;
    out.write_str(end)
}

/// Decimals of a number in thousandths.
const THOUSANDTHS: u8 = 3;

/// A number in units of its last decimal. Three decimals are enough, if the others are zeros.
fn decimal(out: &mut dyn Write, number: i64, decimals: u8) -> fmt::Result {
    let (sign, size) = (if number < 0 { "-" } else { "" }, number.unsigned_abs());
    let unit = 10_u64.saturating_pow(decimals.into());
    let (whole, rest) = (size.checked_div(unit).unwrap_or(size), size.checked_rem(unit).unwrap_or(0));
    write!(out, "{sign}{whole}")?;
    match decimals {
        _ if rest == 0 => Ok(()),
        6 if rest.is_multiple_of(1_000) => write!(out, ".{:03}", rest / 1_000),
        decimals => write!(out, ".{rest:0width$}", width = decimals.into()),
    }
}

/// A name and its unit, as they stand in answers: `period_ms`.
#[derive(Clone, Copy)]
pub struct Label {
    pub name: &'static str,
    pub unit: &'static str,
}

impl Label {
    /// A name without a unit.
    pub const fn plain(name: &'static str) -> Label {
        Label { name, unit: "" }
    }

    /// Its characters.
    pub fn len(&self) -> usize {
        match self.unit() {
            "" => self.name.len(),
            unit => self.name.len().saturating_add(unit.len()).saturating_add(1),
        }
    }

    /// What of the unit stands behind the name: every bit rate is in bit/s.
    const fn unit(&self) -> &'static str {
        match self.unit.as_bytes() {
            b"bit/s" => "",
            _ => self.unit,
        }
    }
}

impl Display for Label {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(self.name)?;
        if self.unit().is_empty() {
            return Ok(());
        }
        out.write_char('_')?;
        self.unit()
            .chars()
            .try_for_each(|character| out.write_char(if character == '/' { '_' } else { character }))
    }
}

fn one_of(out: &mut dyn Write, words: &[&str]) -> fmt::Result {
    let last = words.len().saturating_sub(1);
    for (place, word) in words.iter().enumerate() {
        out.write_str(match place {
            0 => "",
            _ if place == last => " or ",
            _ => ", ",
        })?;
        out.write_str(word)?;
    }
    Ok(())
}

/// As people read it.
impl Display for Value<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.write(out, Audience::People)
    }
}
