//! Why a command was not carried out: one row for each kind of error, and what the gateway refuses in these rows.
//!
//! A row is `kind names|sentence`, see [`Reply::refuse`]: who finds the error names its row and its values, and nothing is
//! built, returned and taken apart in between. Without a sentence the kind is the sentence.

use clino_codec::t7::{EncodeError, Field};
use clino_gateway::config::Kind;
use clino_gateway::order::Refusal;
use clino_gateway::settings::Number;
use clino_gateway::{DegradedMode, INTERNAL_OSCILLATOR_PPM, UART_TOLERANCE_PPM};

use crate::label::Label;
use crate::line::{Damage, LONGEST_LINE, Reason};
use crate::reply::Reply;
use crate::value::{Value, thousandths};

/// There is no such command.
pub const UNKNOWN: &str = "unknown_command|unknown command, try help";
/// Something is missing that this command needs.
pub const MISSING: &str = "missing_argument what|missing {0}";
/// A word is missing, one of these.
pub const MISSING_ONE: &str = "missing_argument what expected|missing {0}: {1}";
/// A setting that is named twice: one of the values is not meant.
pub const TWICE: &str = "named_twice what|{0} is named twice";
/// A word that is none of those expected.
pub const WORD: &str = "bad_argument value expected|{0}: expected {1}";
/// A number out of its range; the last value is the word that was typed.
pub const RANGE: &str = "out_of_range what value least most|{0} {4} is not between {2} and {3}";
/// The same of something that is no number.
pub const NO_NUMBER: &str = "bad_argument what value least most|{0} {1} is not a number between {2} and {3}";
/// An address that no sensor of this kind has.
pub const ADDRESS: &str = "out_of_range what value allowed|{0} {1} is not {2}";
/// A name that is too long, or has other characters.
pub const NAME: &str = "bad_argument why|a name has up to 16 printable characters, no quotation mark";
/// A setting that slots of this kind do not have.
pub const NO_EFFECT: &str = "no_effect what why|{0} has no effect on kind {1}";
/// A negative number, or a word that looks like one, without `--` before it.
pub const BARE_MINUS: &str = "bad_argument why|put -- before a negative number";
/// A word that this command does not take.
pub const UNEXPECTED_WORD: &str = "unexpected_argument value|unexpected argument {0}";
/// An option that this command does not take, by its name.
pub const UNEXPECTED_NAME: &str = "unexpected_option value|unexpected option --{0}";
/// The same, by its letter.
pub const UNEXPECTED_LETTER: &str = "unexpected_option value|unexpected option -{0}";
/// It came during a task that a person waits for.
pub const WORKING: &str = "busy why|line not carried out, a task is running: Ctrl-C stops it";
/// A quotation mark without its other one, or in the middle of a word.
pub const QUOTES: &str = "bad_argument why|a quotation mark that is not closed, or within a word";
/// The slot has no value that could be taken.
pub const NO_VALUE: &str = "no_value slot status|slot {0} is {1}";
/// This board does not have it.
pub const ABSENT: &str = "absent what|this board has no {0}";

const BUSY: &str = "busy|busy, try again";
const BELOW: &str = "out_of_range what value least most|{0} {1} is not between {2} and {3}";
const SHORTER: &str = "does_not_fit what value least why|{0} {1} is less than {3} {2}";
// What follows the others is always long enough.
const SHORTER_STALE: &str =
    "does_not_fit what value least why|{0} {1} is less than {3} {2}: set both, or stale_auto on";
const EXCLUDED: &str = "excluded what why|{0}: conflicts with another setting of the same change";
const BIT_RATE: &str = "bit_rate value why|{0} bit/s is not among {1}";
const FOR_ONE: &str = "refused why|this must not go to the address of all nodes";
const REFUSED: &str = "refused why|{0}";
const INEXACT_CLOCK: &str = "inexact_clock clock_off_percent most_percent why|\
                             the clock may be off by {0} %, a UART tolerates {1} %: sensors are not written to";
const NO_BUSES: &str = "no_buses why|safe mode: the buses are not served";
const TOO_LONG: &str = "line_too_long most characters|line not carried out, characters more than {0}: {1}";
const DAMAGED: &str = "damaged_line reason characters|line not carried out, {2}: {1}";
/// A number that a T7 does not accept; the last value names it.
const NOT_FOR_T7: &str = "out_of_range value least most|{3} {0} is not between {1} and {2}";
/// An irreversible command of a program without `--yes`. Its effect on other nodes and slots stands before the semicolon.
pub const UNCONFIRMED: &str = "unconfirmed why|irreversible, needs --yes";
/// The same, and a slot already reads the new address.
pub const UNCONFIRMED_SHARED: &str =
    "unconfirmed why slot|slot {0} already reads the new address; irreversible, needs --yes";
/// The same, and other nodes fall silent.
pub const UNCONFIRMED_SILENCED: &str = "unconfirmed why silenced|\
    {0} other {1} of the bus {2} at its present bit rate and will not answer; irreversible, needs --yes";

/// An error with one value, found while a line is taken apart.
pub struct Mistake<'a> {
    pub row: &'static str,
    pub value: &'a str,
}

/// The addresses that one sensor of a kind can have.
pub const fn one(kind: Kind) -> &'static str {
    match kind {
        Kind::T7 => "1 to 100 or 127",
        Kind::Isu => "1 to 14",
        Kind::Pwm => "1 or 2",
        Kind::Off => "none",
    }
}

/// The addresses that a slot of a kind can have.
const fn of_slot(kind: Kind) -> &'static str {
    match kind {
        Kind::Isu => "1 to 14, or 0 if it is alone",
        Kind::Off => "0 to 100 or 127",
        Kind::T7 | Kind::Pwm => one(kind),
    }
}

/// Writes why the gateway refuses an order. The values of all reasons are in one place: they are on the stack of every command
/// that gives an order.
#[inline(never)]
pub fn refused(reply: &mut Reply<'_>, refusal: &Refusal) {
    let value = |number: &Number, value| Value::Decimal(value, number.decimals);
    let mut labels = [const { Label::plain("") }; 2];
    let [what, than] = &mut labels;
    let name = |label: &mut Label, number: &Number| *label = Label { name: number.name, unit: number.unit };
    let mut values = [Value::None; 4];
    let [first, second, third, fourth] = &mut values;
    let row = match refusal {
        Refusal::Range { number, least, most } => {
            name(what, number);
            *first = Value::Label(what);
            (*second, *third, *fourth) =
                (value(number, number.value), value(number, *least), value(number, *most));
            BELOW
        }
        Refusal::Shorter { number, least } => {
            name(what, number);
            name(than, least);
            (*first, *fourth) = (Value::Label(what), Value::Label(than));
            (*second, *third) = (value(number, number.value), value(least, least.value));
            if number.name == "stale" { SHORTER_STALE } else { SHORTER }
        }
        Refusal::Address { kind, value } => {
            (*first, *second, *third) = ("address".into(), Value::Decimal(*value, 0), of_slot(*kind).into());
            ADDRESS
        }
        Refusal::Excluded(what) => {
            *first = (*what).into();
            EXCLUDED
        }
        Refusal::BitRate { value, allowed } => {
            (*first, *second) = ((*value).into(), Value::Rates(allowed));
            BIT_RATE
        }
        Refusal::T7(EncodeError::OutOfRange { field, value, min, max }) => {
            let what = match field {
                Field::Offset => "offset_mdeg",
                Field::Damping => "damping_ms",
                _ => "value",
            };
            (*first, *second, *third, *fourth) = ((*value).into(), (*min).into(), (*max).into(), what.into());
            NOT_FOR_T7
        }
        Refusal::T7(EncodeError::NotForAll { .. }) => FOR_ONE,
        Refusal::Isu(cause) => {
            *first = clino_gateway::task::Reason::from(cause).name().into();
            REFUSED
        }
        Refusal::Busy => BUSY,
        Refusal::Degraded(DegradedMode::InexactClock) => {
            // Ten parts per million are a thousandth of a percent.
            *first = thousandths(INTERNAL_OSCILLATOR_PPM / 10);
            *second = thousandths(UART_TOLERANCE_PPM / 10);
            INEXACT_CLOCK
        }
        Refusal::Degraded(_) => NO_BUSES,
    };
    reply.refuse(row, &values);
}

/// Writes that a line is not what was typed, or cannot be known to be.
#[inline(never)]
pub fn damaged(reply: &mut Reply<'_>, damage: Damage) {
    let Damage { reason, characters } = damage;
    match reason {
        Reason::TooLong => reply.refuse(TOO_LONG, &[(LONGEST_LINE as u32).into(), characters.into()]),
        reason => {
            reply.refuse(DAMAGED, &[reason.name().into(), characters.into(), reason.words().into()]);
        }
    }
}
