//! Why a command was not carried out.

use core::fmt::{self, Write};

use clino_codec::t7::EncodeError;
use clino_gateway::order::Refusal;
use embedded_cli::service::ParseError;

use crate::causes;
use crate::fields::{Value, members};
use crate::shell::Audience;

/// Why a command was not carried out.
#[derive(Debug)]
pub enum Error<'a> {
    /// It is no command, or not whole.
    Syntax(ParseError<'a>),
    /// It asks for what cannot be.
    Refused(Refusal),
    /// Something is missing that this command needs.
    Missing(&'static str),
    /// A program's line is longer than this many characters.
    TooLong(usize),
}

impl From<Refusal> for Error<'_> {
    fn from(refusal: Refusal) -> Self {
        Error::Refused(refusal)
    }
}

impl Error<'_> {
    /// Writes it: a sentence for people, `{"error":{"kind":…,…}}` for programs.
    pub fn write(&self, out: &mut dyn Write, audience: Audience) -> fmt::Result {
        if audience == Audience::People {
            return writeln!(out, "error: {self}");
        }
        write!(out, "{{\"error\":{{\"kind\":\"{}\"", self.kind())?;
        self.details(out)?;
        out.write_str("}}\n")
    }

    fn kind(&self) -> &'static str {
        match self {
            Error::Syntax(ParseError::MissingRequiredArgument { .. }) | Error::Missing(_) => {
                "missing_argument"
            }
            Error::Syntax(ParseError::ParseValueError { .. }) => "bad_argument",
            Error::Syntax(ParseError::UnexpectedArgument { .. }) => "unexpected_argument",
            Error::Syntax(
                ParseError::UnexpectedLongOption { .. } | ParseError::UnexpectedShortOption { .. },
            ) => "unexpected_option",
            Error::Syntax(_) => "unknown_command",
            Error::Refused(Refusal::Range { .. }) => "out_of_range",
            Error::Refused(Refusal::BitRate { .. }) => "bit_rate",
            Error::Refused(Refusal::T7(EncodeError::OutOfRange { .. })) => "out_of_range",
            Error::Refused(Refusal::T7(_) | Refusal::Isu(_)) => "refused",
            Error::Refused(Refusal::Busy) => "busy",
            Error::TooLong(_) => "line_too_long",
        }
    }

    fn details(&self, out: &mut dyn Write) -> fmt::Result {
        let mut write = |fields: &[(&str, Value<'_>)]| members(out, Audience::Programs, fields);
        match self {
            Error::Syntax(ParseError::MissingRequiredArgument { name }) => {
                write(&[("what", Value::Text(name))])
            }
            Error::Syntax(ParseError::ParseValueError { value, expected }) => {
                write(&[("value", Value::Text(value)), ("expected", Value::Text(expected))])
            }
            Error::Syntax(
                ParseError::UnexpectedArgument { value: word }
                | ParseError::UnexpectedLongOption { name: word },
            ) => write(&[("value", Value::Text(word))]),
            Error::Syntax(ParseError::UnexpectedShortOption { name }) => {
                write(&[("value", Value::Words(name))])
            }
            Error::Refused(Refusal::Range { what, value, least, most }) => write(&[
                ("what", Value::Text(what)),
                ("value", (*value).into()),
                ("least", (*least).into()),
                ("most", (*most).into()),
            ]),
            Error::Refused(Refusal::BitRate { value, .. }) => {
                write(&[("value", (*value).into()), ("why", Value::Words(self))])
            }
            Error::Refused(Refusal::T7(EncodeError::OutOfRange { value, min, max, .. })) => {
                write(&[("value", (*value).into()), ("least", (*min).into()), ("most", (*max).into())])
            }
            Error::Refused(Refusal::T7(EncodeError::NotForAll { .. })) => write(&[]),
            Error::Refused(Refusal::Isu(cause)) => write(&[("why", Value::Text(causes::isu(cause)))]),
            Error::Missing(what) => write(&[("what", Value::Text(what))]),
            Error::TooLong(most) => write(&[("most", (*most as u64).into())]),
            Error::Syntax(_) | Error::Refused(Refusal::Busy) => Ok(()),
        }
    }
}

impl fmt::Display for Error<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::Syntax(ParseError::MissingRequiredArgument { name }) => {
                write!(out, "missing argument {name}")
            }
            Error::Syntax(ParseError::ParseValueError { value, expected }) => {
                write!(out, "{value}: expected {expected}")
            }
            Error::Syntax(ParseError::UnexpectedArgument { value }) => {
                write!(out, "unexpected argument {value}")
            }
            Error::Syntax(ParseError::UnexpectedLongOption { name }) => {
                write!(out, "unexpected option --{name}")
            }
            Error::Syntax(ParseError::UnexpectedShortOption { name }) => {
                write!(out, "unexpected option -{name}")
            }
            Error::Syntax(_) => out.write_str("unknown command, try help"),
            Error::Refused(Refusal::Range { what, value, least, most }) => {
                write!(out, "{what} {value} is not between {least} and {most}")
            }
            Error::Refused(Refusal::BitRate { value, allowed }) => {
                write!(out, "the sensors do not have {value} bit/s, only")?;
                allowed.iter().try_for_each(|rate| write!(out, " {rate}"))
            }
            Error::Refused(Refusal::T7(error)) => write!(out, "{error}"),
            Error::Refused(Refusal::Isu(cause)) => out.write_str(causes::isu(cause)),
            Error::Refused(Refusal::Busy) => out.write_str("busy, try again"),
            Error::Missing(what) => write!(out, "missing {what}"),
            Error::TooLong(most) => write!(out, "more than {most} characters"),
        }
    }
}
