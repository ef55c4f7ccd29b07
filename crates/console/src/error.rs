//! Why a command was not carried out.

use core::fmt::{self, Display};

use clino_codec::t7::EncodeError;
use clino_gateway::Status;
use clino_gateway::order::Refusal;

use crate::causes;
use crate::host::StorageError;
use crate::number;
use crate::reply::Reply;
use crate::value::Value;

/// Why a command was not carried out.
pub enum Error<'a> {
    /// There is no such command.
    Unknown,
    /// Something is missing that this command needs.
    Missing(&'static str),
    /// A word that is none of those expected.
    Word { value: &'a str, expected: &'static [&'static str] },
    /// A number out of its range, in units of its last decimal; or no number.
    Range { what: &'static str, word: &'a str, value: Option<i64>, least: i64, most: i64, decimals: u32 },
    /// A number below zero, or what looks like one, without `--` before it.
    BareMinus,
    /// A word, or an option with the dashes before it, that this command does not take.
    Unexpected(&'static str, &'a str),
    /// An option of one letter that this command does not take.
    UnexpectedLetter(char),
    /// It asks for what cannot be.
    Refused(Refusal),
    /// A program's line is longer than this many characters.
    TooLong(usize),
    /// What is done cannot be undone, and a program has not said that it is meant.
    Unconfirmed,
    /// The slot has no value that could be taken.
    NoValue { slot: u8, status: Status },
    /// What is stored cannot be read or written.
    Storage(StorageError),
    /// This board does not have it.
    Absent(&'static str),
}

impl Error<'_> {
    /// Writes it: a sentence for people, `{"error":{"kind":…,…}}` for programs.
    #[inline(never)]
    pub fn write(&self, reply: &mut Reply<'_>) {
        if reply.is_for_people() {
            _ = writeln!(reply.out, "error: {self}");
            return;
        }
        _ = write!(reply.out, "{{\"error\":{{\"kind\":\"{}\"", self.kind());
        self.details(reply);
        reply.say("}}\n");
    }

    fn kind(&self) -> &'static str {
        match self {
            Error::Unknown => "unknown_command",
            Error::Missing(_) => "missing_argument",
            Error::Word { .. } | Error::Range { value: None, .. } | Error::BareMinus => "bad_argument",
            Error::Range { .. }
            | Error::Refused(Refusal::Range { .. } | Refusal::T7(EncodeError::OutOfRange { .. })) => {
                "out_of_range"
            }
            Error::Unexpected("", _) => "unexpected_argument",
            Error::Unexpected(..) | Error::UnexpectedLetter(_) => "unexpected_option",
            Error::Refused(Refusal::BitRate { .. }) => "bit_rate",
            Error::Refused(Refusal::T7(_) | Refusal::Isu(_)) => "refused",
            Error::Refused(Refusal::Busy) => "busy",
            Error::TooLong(_) => "line_too_long",
            Error::Unconfirmed => "unconfirmed",
            Error::NoValue { .. } => "no_value",
            Error::Storage(error) => error.name(),
            Error::Absent(_) => "absent",
        }
    }

    fn details(&self, reply: &mut Reply<'_>) {
        let why = Value::Words(self);
        match *self {
            Error::Missing(what) | Error::Absent(what) => reply.members("what", &[what.into()]),
            Error::Word { value, expected } => {
                reply.members("value expected", &[value.into(), Value::Words(&List(expected))]);
            }
            Error::Range { what, word, value, least, most, decimals } => {
                let value = value.map_or(Value::Text(word), |value| scaled(value, decimals));
                let values = [what.into(), value, scaled(least, decimals), scaled(most, decimals)];
                reply.members(RANGE, &values);
            }
            Error::Refused(Refusal::Range { what, value, least, most }) => {
                reply.members(RANGE, &[what.into(), value.into(), least.into(), most.into()]);
            }
            Error::Refused(Refusal::T7(EncodeError::OutOfRange { value, min, max, .. })) => {
                reply.members("value least most", &[value.into(), min.into(), max.into()]);
            }
            Error::Unexpected(_, value) => reply.members("value", &[value.into()]),
            Error::UnexpectedLetter(letter) => reply.members("value", &[Value::Words(&letter)]),
            Error::Refused(Refusal::BitRate { value, .. }) => {
                reply.members("value why", &[value.into(), why]);
            }
            Error::TooLong(most) => reply.members("most", &[Value::from(most as u64)]),
            Error::NoValue { slot, status } => {
                reply.members("slot status", &[slot.into(), status.name().into()]);
            }
            Error::BareMinus | Error::Unconfirmed | Error::Refused(Refusal::Isu(_)) => {
                reply.members("why", &[why]);
            }
            Error::Unknown | Error::Refused(Refusal::T7(_) | Refusal::Busy) | Error::Storage(_) => {}
        }
    }
}

/// What is said of a number out of its range.
const RANGE: &str = "what value least most";

fn scaled(number: i64, decimals: u32) -> Value<'static> {
    if decimals == number::DECIMALS { Value::Thousandths(number) } else { Value::Number(number) }
}

impl Display for Error<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::Unknown => out.write_str("unknown command, try help"),
            Error::Missing(what) => write!(out, "missing {what}"),
            Error::Word { value, expected } => write!(out, "{value}: expected {}", List(expected)),
            Error::Range { what, word, value, least, most, decimals } => {
                let number = if value.is_none() { "a number " } else { "" };
                let [least, most] = [*least, *most].map(|number| scaled(number, *decimals));
                write!(out, "{what} {word} is not {number}between {least} and {most}")
            }
            Error::BareMinus => out.write_str("a number below zero wants -- before it"),
            Error::Unexpected("", value) => write!(out, "unexpected argument {value}"),
            Error::Unexpected(dashes, value) => write!(out, "unexpected option {dashes}{value}"),
            Error::UnexpectedLetter(letter) => write!(out, "unexpected option -{letter}"),
            Error::Refused(Refusal::Range { what, value, least, most }) => {
                write!(out, "{what} {value} is not between {least} and {most}")
            }
            Error::Refused(Refusal::BitRate { value, allowed }) => {
                write!(out, "{value} bit/s is not among")?;
                allowed.iter().try_for_each(|rate| write!(out, " {rate}"))
            }
            Error::Refused(Refusal::T7(error)) => write!(out, "{error}"),
            Error::Refused(Refusal::Isu(cause)) => out.write_str(causes::isu(cause)),
            Error::Refused(Refusal::Busy) => out.write_str("busy, try again"),
            Error::TooLong(most) => write!(out, "more than {most} characters"),
            Error::Unconfirmed => out.write_str("not to be undone, wants --yes"),
            Error::NoValue { slot, status } => write!(out, "slot {slot} is {}", status.name()),
            Error::Storage(error) => out.write_str(error.name()),
            Error::Absent(what) => write!(out, "this board has no {what}"),
        }
    }
}

/// Words, one of which is expected.
struct List(&'static [&'static str]);

impl Display for List {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let last = self.0.len().saturating_sub(1);
        self.0.iter().enumerate().try_for_each(|(place, word)| {
            out.write_str(match place {
                0 => "",
                _ if place == last => " or ",
                _ => ", ",
            })?;
            out.write_str(word)
        })
    }
}
