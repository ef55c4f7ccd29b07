//! Why a command was not carried out.

use core::fmt::{self, Display};

use clino_codec::t7::EncodeError;
use clino_gateway::config::Kind;
use clino_gateway::order::Refusal;
use clino_gateway::settings::Number;
use clino_gateway::{Consequence, DegradedMode, INTERNAL_OSCILLATOR_PPM, Status, UART_TOLERANCE_PPM};

use crate::consequences::{self, Effect};
use crate::host::StorageError;
use crate::line::{Damage, ERROR, LONGEST_LINE, Reason};
use crate::reply::Reply;
use crate::value::{Label, Value};

/// Why a command was not carried out.
pub enum Error<'a> {
    /// There is no such command.
    Unknown,
    /// Something is missing that this command needs.
    Missing(&'static str),
    /// A word is missing, one of these.
    MissingOne { what: &'static str, expected: &'static [&'static str] },
    /// A setting that is named twice: one of the values is not meant.
    Twice(&'static str),
    /// A word that is none of those expected.
    Word { value: &'a str, expected: &'static [&'static str] },
    /// A number out of its range, in units of its last decimal; or no number.
    Range { what: Label, word: &'a str, value: Option<i64>, least: i64, most: i64, decimals: u8 },
    /// An address that no single sensor of this kind has.
    NotOne { kind: Kind, value: u8 },
    /// A name that is too long, or has other characters.
    Name,
    /// A setting that slots of this kind do not have.
    NotOf { setting: &'static str, kind: Kind },
    /// A negative number, or a word that looks like one, without `--` before it.
    BareMinus,
    /// A word, or an option with the dashes before it, that this command does not take.
    Unexpected(&'static str, &'a str),
    /// An option of one letter that this command does not take.
    UnexpectedLetter(char),
    /// The gateway refuses the order.
    Refused(Refusal),
    /// The line is not what was typed, or cannot be known to be.
    Damaged(Damage),
    /// It came during a task that a person waits for.
    Working,
    /// A quotation mark without its other one, or in the middle of a word.
    Quotes,
    /// An irreversible command of a program without `--yes`.
    Unconfirmed(Consequence),
    /// The slot has no value that could be taken.
    NoValue { slot: u8, status: Status },
    /// The storage cannot be read or written.
    Storage(StorageError),
    /// This board does not have it.
    Absent(&'static str),
}

impl Error<'_> {
    /// Writes it: a sentence for people, `{"error":{"kind":…,…}}` for programs.
    #[inline(never)]
    pub fn write(&self, reply: &mut Reply<'_>) {
        if reply.is_for_people() {
            _ = writeln!(reply.out, "{ERROR}{self}");
            return;
        }
        let (kind, names, values) = self.parts();
        _ = write!(reply.out, "{{\"error\":{{\"kind\":\"{kind}\"");
        if !names.is_empty() {
            reply.members(names, &values);
        }
        reply.say("}}\n");
    }

    /// Its kind, and what belongs to it: as many values as there are names.
    fn parts(&self) -> (&'static str, &'static str, [Value<'_>; 4]) {
        const NONE: Value<'static> = Value::None;
        let why = Value::Words(self);
        match *self {
            Error::Unknown => ("unknown_command", "", [NONE; 4]),
            Error::Missing(what) => ("missing_argument", "what", [what.into(), NONE, NONE, NONE]),
            Error::MissingOne { what, expected } => {
                ("missing_argument", "what expected", [what.into(), Value::OneOf(expected), NONE, NONE])
            }
            Error::Twice(what) => ("named_twice", "what", [what.into(), NONE, NONE, NONE]),
            Error::Word { value, expected } => {
                ("bad_argument", "value expected", [value.into(), Value::OneOf(expected), NONE, NONE])
            }
            Error::Range { what, word, value, least, most, decimals } => {
                let kind = if value.is_some() { "out_of_range" } else { "bad_argument" };
                let value = value.map_or(Value::Text(word), |value| scaled(value, decimals));
                (kind, RANGE, [Value::Label(what), value, scaled(least, decimals), scaled(most, decimals)])
            }
            Error::NotOne { kind, value } => {
                ("out_of_range", ADDRESS, ["address".into(), value.into(), one(kind).into(), NONE])
            }
            Error::Name => ("bad_argument", "why", [why, NONE, NONE, NONE]),
            Error::NotOf { setting, .. } => ("no_effect", "what why", [setting.into(), why, NONE, NONE]),
            Error::BareMinus => ("bad_argument", "why", [why, NONE, NONE, NONE]),
            Error::Unexpected(dashes, value) => {
                let kind = if dashes.is_empty() { "unexpected_argument" } else { "unexpected_option" };
                (kind, "value", [value.into(), NONE, NONE, NONE])
            }
            Error::UnexpectedLetter(ref letter) => {
                ("unexpected_option", "value", [Value::Words(letter), NONE, NONE, NONE])
            }
            Error::Refused(Refusal::Range { number, least, most }) => {
                let [least, most] = [least, most].map(|limit| scaled(limit, number.decimals));
                ("out_of_range", RANGE, [Value::Label(label(&number)), told(&number), least, most])
            }
            Error::Refused(Refusal::Shorter { number, least }) => (
                "does_not_fit",
                "what value least why",
                [Value::Label(label(&number)), told(&number), told(&least), why],
            ),
            Error::Refused(Refusal::Address { kind, value }) => {
                ("out_of_range", ADDRESS, ["address".into(), value.into(), addresses(kind).into(), NONE])
            }
            Error::Refused(Refusal::Excluded(what)) => {
                ("excluded", "what why", [what.into(), why, NONE, NONE])
            }
            Error::Refused(Refusal::T7(EncodeError::OutOfRange { value, min, max, .. })) => {
                ("out_of_range", "value least most", [value.into(), min.into(), max.into(), NONE])
            }
            Error::Refused(Refusal::BitRate { value, .. }) => {
                ("bit_rate", "value why", [value.into(), why, NONE, NONE])
            }
            Error::Refused(Refusal::T7(_) | Refusal::Isu(_)) => ("refused", "why", [why, NONE, NONE, NONE]),
            Error::Refused(Refusal::Busy) => ("busy", "", [NONE; 4]),
            Error::Refused(Refusal::Degraded(DegradedMode::InexactClock)) => {
                let [off, most] = [INTERNAL_OSCILLATOR_PPM, UART_TOLERANCE_PPM].map(percent);
                ("inexact_clock", "clock_off_percent most_percent why", [off, most, why, NONE])
            }
            Error::Refused(Refusal::Degraded(_)) => ("no_buses", "why", [why, NONE, NONE, NONE]),
            Error::Damaged(Damage { reason: Reason::TooLong, characters }) => {
                let most = Value::from(LONGEST_LINE as u64);
                ("line_too_long", "most characters", [most, characters.into(), NONE, NONE])
            }
            Error::Damaged(Damage { reason, characters }) => {
                ("damaged_line", "reason characters", [reason.name().into(), characters.into(), NONE, NONE])
            }
            Error::Working => ("busy", "why", [why, NONE, NONE, NONE]),
            Error::Quotes => ("bad_argument", "why", [why, NONE, NONE, NONE]),
            Error::Unconfirmed(Consequence { silenced: 0, shared: None }) => {
                ("unconfirmed", "why", [why, NONE, NONE, NONE])
            }
            Error::Unconfirmed(consequence) => {
                let (names, value) = consequences::named(consequence);
                ("unconfirmed", names, [why, value, NONE, NONE])
            }
            Error::NoValue { slot, status } => {
                ("no_value", "slot status", [slot.into(), status.name().into(), NONE, NONE])
            }
            Error::Storage(error) => (error.name(), "", [NONE; 4]),
            Error::Absent(what) => ("absent", "what", [what.into(), NONE, NONE, NONE]),
        }
    }
}

/// Names of the values of a number out of its range.
const RANGE: &str = "what value least most";

/// Names of the values of an invalid address.
const ADDRESS: &str = "what value allowed";

/// Parts per million in percent.
fn percent(ppm: u32) -> Value<'static> {
    // Ten of them are a thousandth of a percent.
    Value::Thousandths((ppm / 10).into())
}

fn scaled(number: i64, decimals: u8) -> Value<'static> {
    Value::Decimal(number, decimals)
}

fn label(number: &Number) -> Label {
    Label { name: number.name, unit: number.unit }
}

fn told(number: &Number) -> Value<'static> {
    Value::Decimal(number.value, number.decimals)
}

/// The addresses that a slot of a kind can have.
const fn addresses(kind: Kind) -> &'static str {
    match kind {
        Kind::Isu => "1 to 14, or 0 if it is alone",
        Kind::Off => "0 to 100 or 127",
        Kind::T7 | Kind::Pwm => one(kind),
    }
}

/// The addresses that one sensor of a kind can have.
const fn one(kind: Kind) -> &'static str {
    match kind {
        Kind::T7 => "1 to 100 or 127",
        Kind::Isu => "1 to 14",
        Kind::Pwm => "1 or 2",
        Kind::Off => "none",
    }
}

impl Display for Error<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::Unknown => out.write_str("unknown command, try help"),
            Error::Missing(what) => write!(out, "missing {what}"),
            Error::MissingOne { what, expected } => {
                write!(out, "missing {what}: {}", Value::OneOf(expected))
            }
            Error::Twice(what) => write!(out, "{what} is named twice"),
            Error::Word { value, expected } => write!(out, "{value}: expected {}", Value::OneOf(expected)),
            Error::Range { what, word, value, least, most, decimals } => {
                let number = if value.is_none() { "a number " } else { "" };
                let [least, most] = [*least, *most].map(|number| scaled(number, *decimals));
                write!(out, "{what} {word} is not {number}between {least} and {most}")
            }
            Error::BareMinus => out.write_str("put -- before a negative number"),
            Error::Unexpected("", value) => write!(out, "unexpected argument {value}"),
            Error::Unexpected(dashes, value) => write!(out, "unexpected option {dashes}{value}"),
            Error::UnexpectedLetter(letter) => write!(out, "unexpected option -{letter}"),
            Error::NotOne { kind, value } => write!(out, "address {value} is not {}", one(*kind)),
            Error::Name => out.write_str("a name has up to 16 printable characters, no quotation mark"),
            Error::NotOf { setting, kind } => write!(out, "{setting} has no effect on kind {}", kind.name()),
            Error::Refused(Refusal::Range { number, least, most }) => {
                let [least, most] = [least, most].map(|limit| scaled(*limit, number.decimals));
                write!(out, "{} {} is not between {least} and {most}", label(number), told(number))
            }
            Error::Refused(Refusal::Shorter { number, least }) => {
                let (what, than) = (label(number), label(least));
                write!(out, "{what} {} is less than {than} {}", told(number), told(least))?;
                // What follows the others is always long enough.
                if number.name == "stale" { out.write_str(": set both, or stale_auto on") } else { Ok(()) }
            }
            Error::Refused(Refusal::Address { kind, value }) => {
                write!(out, "address {value} is not {}", addresses(*kind))
            }
            Error::Refused(Refusal::Excluded(what)) => {
                write!(out, "{what}: conflicts with another setting of the same change")
            }
            Error::Refused(Refusal::BitRate { value, allowed }) => {
                write!(out, "{value} bit/s is not among")?;
                allowed.iter().try_for_each(|rate| write!(out, " {rate}"))
            }
            Error::Refused(Refusal::T7(error)) => write!(out, "{error}"),
            Error::Refused(Refusal::Isu(cause)) => {
                out.write_str(clino_gateway::task::Reason::from(cause).name())
            }
            Error::Refused(Refusal::Busy) => out.write_str("busy, try again"),
            Error::Refused(Refusal::Degraded(DegradedMode::InexactClock)) => {
                let [off, most] = [INTERNAL_OSCILLATOR_PPM, UART_TOLERANCE_PPM].map(percent);
                write!(
                    out,
                    "the clock may be off by {off} %, a UART tolerates {most} %: sensors are not written to"
                )
            }
            Error::Refused(Refusal::Degraded(_)) => out.write_str("safe mode: the buses are not served"),
            Error::Damaged(Damage { reason, characters }) => {
                write!(out, "line not carried out, {}: {characters}", reason.words())
            }
            Error::Working => out.write_str("line not carried out, a task is running: Ctrl-C stops it"),
            Error::Quotes => out.write_str("a quotation mark that is not closed, or within a word"),
            Error::Unconfirmed(consequence) => {
                let separator = if *consequence == Consequence::NONE { "" } else { "; " };
                write!(out, "{}{separator}irreversible, needs --yes", Effect(*consequence))
            }
            Error::NoValue { slot, status } => write!(out, "slot {slot} is {}", status.name()),
            Error::Storage(error) => out.write_str(error.name()),
            Error::Absent(what) => write!(out, "this board has no {what}"),
        }
    }
}
