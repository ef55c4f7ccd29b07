//! One answer as a list of named values: for people a line of words, for programs one JSON object.

use core::fmt::{self, Display, Write};

use clino_codec::angle::Angle;

use crate::shell::Audience;

/// Thousandths of a degree: what a T7 resolves.
pub const DECIMALS: usize = 3;

/// A value of an answer.
#[derive(Clone, Copy)]
pub enum Value<'a> {
    /// A number.
    Number(i64),
    /// An angle, in degrees.
    Angle(Angle),
    /// A word, or a few.
    Text(&'a str),
    /// Something that says itself in words.
    Words(&'a dyn Display),
    /// Yes or no.
    Flag(bool),
    /// There is none.
    None,
}

impl From<u8> for Value<'_> {
    fn from(number: u8) -> Self {
        Value::Number(i64::from(number))
    }
}

impl From<u16> for Value<'_> {
    fn from(number: u16) -> Self {
        Value::Number(i64::from(number))
    }
}

impl From<u32> for Value<'_> {
    fn from(number: u32) -> Self {
        Value::Number(i64::from(number))
    }
}

impl From<u64> for Value<'_> {
    fn from(number: u64) -> Self {
        Value::Number(i64::try_from(number).unwrap_or(i64::MAX))
    }
}

impl From<i32> for Value<'_> {
    fn from(number: i32) -> Self {
        Value::Number(i64::from(number))
    }
}

/// Writes one answer, a line: `what: name value, name value`, or `{"what":…,"name":value,…}`.
pub fn line(
    out: &mut dyn Write,
    audience: Audience,
    what: &str,
    fields: &[(&str, Value<'_>)],
) -> fmt::Result {
    match audience {
        Audience::People => out.write_str(what)?,
        Audience::Programs => write!(out, "{{\"what\":\"{what}\"")?,
    }
    members(out, audience, fields)?;
    out.write_str(match audience {
        Audience::People => "\n",
        Audience::Programs => "}\n",
    })
}

/// Writes the names and values of an answer that has begun.
pub fn members(out: &mut dyn Write, audience: Audience, fields: &[(&str, Value<'_>)]) -> fmt::Result {
    for (place, (name, value)) in fields.iter().enumerate() {
        match audience {
            Audience::People => write!(out, "{} {name} ", if place == 0 { ":" } else { "," })?,
            Audience::Programs => write!(out, ",\"{name}\":")?,
        }
        value.write(out, audience)?;
    }
    Ok(())
}

impl Value<'_> {
    fn write(self, out: &mut dyn Write, audience: Audience) -> fmt::Result {
        let quote = if audience == Audience::Programs { "\"" } else { "" };
        match self {
            Value::Number(number) => write!(out, "{number}"),
            Value::Angle(angle) => out.write_str(angle.text(DECIMALS).as_str()),
            Value::Text(text) => write!(out, "{quote}{}{quote}", Plain(&text)),
            Value::Words(words) => write!(out, "{quote}{}{quote}", Plain(words)),
            Value::Flag(flag) => out.write_str(match (audience, flag) {
                (Audience::People, true) => "yes",
                (Audience::People, false) => "no",
                (Audience::Programs, true) => "true",
                (Audience::Programs, false) => "false",
            }),
            Value::None => out.write_str(match audience {
                Audience::People => "none",
                Audience::Programs => "null",
            }),
        }
    }
}

/// Text as it may stand in a JSON string: what would have to be escaped is left out. It is a sensor's own text, or
/// repeats what was typed.
pub struct Plain<'a, T: ?Sized>(pub &'a T);

impl<T: Display + ?Sized> Display for Plain<'_, T> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(Filter(out), "{}", self.0)
    }
}

struct Filter<'a, 'b>(&'a mut fmt::Formatter<'b>);

impl Write for Filter<'_, '_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let plain = |character: &char| !character.is_control() && !matches!(character, '"' | '\\');
        text.chars().filter(plain).try_for_each(|character| self.0.write_char(character))
    }
}
