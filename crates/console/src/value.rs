//! A value of an answer: how it is written for people, and in JSON.

use clino_codec::angle::Angle;
use clino_gateway::settings::Form;
use clino_gateway::summary::Signals;
use clino_gateway::{Health, Published};
use clino_recovery::Uid;

use crate::audience::Audience;
use crate::choice::Choice;
use crate::label::Label;
use crate::out::{Inside, Out, Width, repeat};
use crate::split::split_before;

/// Decimals of an angle, in degrees: what a T7 resolves.
const DECIMALS: usize = 3;

/// A value of an answer. Small, and cheap to make: answers are lists of them.
#[derive(Clone, Copy)]
pub enum Value<'a> {
    /// There is none.
    None,
    /// Yes or no.
    Flag(bool),
    /// A number.
    Count(u32),
    /// A number with this number of decimals, in units of the last one; without a point if it is whole.
    Decimal(i64, u8),
    /// A number in thousandths, always with three decimals: a program takes its type from the text.
    Thousandths(i32),
    /// An angle, in degrees.
    Angle(Angle),
    /// An address, or bits: eight hexadecimal digits.
    Hex(u32),
    /// The number of a chip.
    Uid(&'a Uid),
    /// A word, or a few.
    Text(&'a str),
    /// A name that a person has given: may be empty, or have any printable character.
    Quoted(&'a str),
    /// A name with its unit.
    Label(&'a Label),
    /// Words, one of which is expected.
    OneOf(Choice),
    /// Bit rates.
    Rates(&'static [u32]),
    /// What a setting can be, in this unit.
    Allowed(&'static Form, &'a &'static str),
    /// Signals of a slot.
    Health(Health),
    /// Signals of the gateway.
    Signals(Signals),
}

/// A number with three decimals, in thousandths.
pub fn thousandths(number: impl Into<i64>) -> Value<'static> {
    Value::Decimal(number.into(), THOUSANDTHS)
}

/// Decimals of a number in thousandths.
pub const THOUSANDTHS: u8 = 3;

macro_rules! counts {
    ($($type:ty),*) => {$(
        impl From<$type> for Value<'_> {
            fn from(number: $type) -> Self {
                Value::Count(number.into())
            }
        }
    )*};
}

counts!(u8, u16, u32);

impl From<i32> for Value<'_> {
    fn from(number: i32) -> Self {
        Value::Decimal(number.into(), 0)
    }
}

impl From<u64> for Value<'_> {
    fn from(number: u64) -> Self {
        Value::Decimal(i64::try_from(number).unwrap_or(i64::MAX), 0)
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
    #[inline(never)]
    pub fn write(self, out: &mut dyn Out, audience: Audience) {
        let programs = audience == Audience::Programs;
        self.quote(out, programs);
        match self {
            Value::None => out.put(if programs { b"null" } else { b"none" }),
            Value::Flag(flag) => out.put(match (programs, flag) {
                (false, true) => b"yes",
                (false, false) => b"no",
                (true, true) => b"true",
                (true, false) => b"false",
            }),
            Value::Count(number) => decimal(out, number.into(), 0),
            Value::Decimal(number, decimals) => decimal(out, number, decimals),
            Value::Thousandths(number) => digits(out, number.into(), THOUSANDTHS, false),
            Value::Angle(angle) => degrees(out, angle),
            Value::Hex(bits) => {
                out.put(b"0x");
                hexadecimal(out, bits);
            }
            Value::Uid(Uid(words)) => words.iter().rev().for_each(|&word| hexadecimal(out, word)),
            Value::Text(text) => Inside { out, escapes: false }.put(text.as_bytes()),
            Value::Quoted(text) => {
                out.put(b"\"");
                match audience {
                    Audience::People => out.put(text.as_bytes()),
                    Audience::Programs => Inside { out, escapes: true }.put(text.as_bytes()),
                }
                out.put(b"\"");
            }
            Value::Label(label) => label.write(out),
            Value::OneOf(choice) => one_of(out, choice),
            Value::Rates(rates) => separated(out, b" ", rates),
            Value::Allowed(form, unit) => allowed(out, form, unit),
            Value::Health(health) => names(out, programs, &mut health.names()),
            Value::Signals(signals) => names(out, programs, &mut signals.names()),
        }
        self.quote(out, programs);
    }

    /// The quotes of words in JSON. All but texts are the console's own words, in which nothing needs to be escaped.
    #[inline(never)]
    fn quote(&self, out: &mut dyn Out, programs: bool) {
        let is_words = matches!(
            self,
            Value::Hex(_)
                | Value::Uid(_)
                | Value::Text(_)
                | Value::Label(_)
                | Value::OneOf(_)
                | Value::Rates(_)
                | Value::Allowed(..)
        );
        if programs && is_words {
            out.put(b"\"");
        }
    }
}

// What needs room of its own is a function of its own: each value is written above the whole stack of its command.

#[inline(never)]
fn degrees(out: &mut dyn Out, angle: Angle) {
    out.put(angle.text(DECIMALS).as_str().as_bytes());
}

/// Names of signals, or that there are none.
#[inline(never)]
fn names(out: &mut dyn Out, programs: bool, names: &mut dyn Iterator<Item = &'static str>) {
    let (begin, between, end): (&[u8], &[u8], &[u8]) =
        if programs { (b"[\"", b"\",\"", b"\"]") } else { (b"", b" ", b"") };
    let mut before = begin;
    let mut any = false;
    for name in names {
        out.put(before);
        out.put(name.as_bytes());
        (before, any) = (between, true);
    }
    out.put(match (any, programs) {
        (true, _) => end,
        (false, true) => b"[]",
        (false, false) => b"well",
    });
}

/// Digits of the largest 64-bit number.
const DIGITS: usize = 20;
/// Decimals after which only zeros are left out: a number in millionths that is one in thousandths.
const MILLIONTHS: usize = 6;

/// A number in units of its last decimal. Three decimals are enough, if the others are zeros; none if all are. Inlined: one
/// call less above the stack of every command.
#[inline(always)]
fn decimal(out: &mut dyn Out, number: i64, decimals: u8) {
    digits(out, number, decimals, true);
}

/// A tenth, and the last digit. Nearly all numbers have 32 bits, which the processor divides in one instruction.
fn by_ten(number: u64) -> (u64, u8) {
    match u32::try_from(number) {
        Ok(number) => (u64::from(number / 10), (number % 10) as u8),
        Err(_) => (number / 10, (number % 10) as u8),
    }
}

/// A number with a point before its last `decimals` digits, or without those that are needless.
#[inline(never)]
fn digits(out: &mut dyn Out, number: i64, decimals: u8, short: bool) {
    let mut text = [b'0'; DIGITS];
    let mut rest = number.unsigned_abs();
    let mut used = 0_usize;
    let decimals = usize::from(decimals);
    for place in text.iter_mut().rev() {
        if rest == 0 && used > decimals {
            break;
        }
        let digit;
        (rest, digit) = by_ten(rest);
        *place = b'0'.wrapping_add(digit);
        used = used.saturating_add(1);
    }
    let text = text.get(DIGITS.saturating_sub(used)..).unwrap_or_default();
    let (whole, mut fraction) = text.split_at_checked(used.saturating_sub(decimals)).unwrap_or_default();
    if number < 0 {
        out.put(b"-");
    }
    out.put(whole);
    if short {
        if decimals == MILLIONTHS {
            fraction = fraction.strip_suffix(b"000").unwrap_or(fraction);
        }
        fraction = if fraction.iter().all(|&digit| digit == b'0') { b"" } else { fraction };
    }
    if !fraction.is_empty() {
        out.put(b".");
        out.put(fraction);
    }
}

/// Eight hexadecimal digits.
fn hexadecimal(out: &mut dyn Out, word: u32) {
    for place in (0..8_u32).rev() {
        let digit = word.wrapping_shr(place.wrapping_mul(4)) as u8 & 0xF;
        out.put(&[digit.wrapping_add(if digit < 10 { b'0' } else { b'a'.wrapping_sub(10) })]);
    }
}

#[inline(never)]
fn one_of(out: &mut dyn Out, choice: Choice) {
    let mut words = choice.all();
    let mut next = words.next();
    let mut before: &[u8] = b"";
    while let Some(word) = next {
        next = words.next();
        out.put(if next.is_none() && !before.is_empty() { b" or " } else { before });
        out.put(word.as_bytes());
        before = b", ";
    }
}

fn separated(out: &mut dyn Out, separator: &[u8], numbers: &[u32]) {
    let mut before: &[u8] = b"";
    for &number in numbers {
        out.put(before);
        decimal(out, number.into(), 0);
        before = separator;
    }
}

/// Allowed values of a setting.
fn allowed(out: &mut dyn Out, form: &Form, unit: &str) {
    match *form {
        Form::Flag => out.put(b"on|off"),
        Form::Slot => out.put(b"SLOT|none"),
        Form::Characters => out.put(b"TEXT"),
        Form::Choice(words) => {
            let mut before: &[u8] = b"";
            for word in words.iter().filter(|word| !word.is_empty()) {
                out.put(before);
                out.put(word.as_bytes());
                before = b"|";
            }
        }
        Form::OneOf(numbers) => separated(out, b"|", numbers),
        Form::Number { least, most, decimals } => {
            decimal(out, least.into(), decimals);
            out.put(b" to ");
            decimal(out, most.into(), decimals);
            if !unit.is_empty() {
                out.put(b" ");
                out.put(unit.as_bytes());
            }
        }
    }
}

/// Writes a text with values in it, as people read them. `{0}` is the first of them; `{0<12}` and `{0>4}` have blanks
/// behind and before it, to this width. A value that is not there is left out.
#[inline(never)]
pub fn print(out: &mut dyn Out, template: &str, values: &[Value<'_>]) {
    let mut rest = template;
    loop {
        let (text, behind) = split_before(rest, b'{');
        out.put(text.as_bytes());
        let Some(place) = behind.strip_prefix('{') else { return };
        let (place, behind) = split_before(place, b'}');
        rest = behind.strip_prefix('}').unwrap_or("");
        let mut place = place.bytes();
        let mut digit = || place.next().map(|byte| usize::from(byte.wrapping_sub(b'0')));
        let Some(&value) = digit().and_then(|number| values.get(number)) else { continue };
        let is_left = digit() == Some(LEFT);
        let width = core::iter::from_fn(digit)
            .fold(0, |width: usize, digit| width.wrapping_mul(10).wrapping_add(digit));
        let blanks = match width {
            0 => 0,
            width => {
                let mut taken = Width(0);
                value.write(&mut taken, Audience::People);
                width.saturating_sub(taken.0)
            }
        };
        if !is_left {
            repeat(out, b' ', blanks);
        }
        value.write(out, Audience::People);
        if is_left {
            repeat(out, b' ', blanks);
        }
    }
}

/// `<` as a digit.
const LEFT: usize = (b'<' - b'0') as usize;
