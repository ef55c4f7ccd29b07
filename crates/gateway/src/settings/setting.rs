//! The parts of a table of settings.
//!
//! A value is a whole number in the unit of its last decimal: a period of 33.333 ms is 33 333, a filter is the position of
//! its word. A door that counts in coarser units (the Modbus map in whole milliseconds) says so with [`Given::scale`].

use core::borrow::{Borrow, BorrowMut};
use core::ops::Deref;

use crate::config::are_characters;
use crate::refusal::{Number, Refusal};

/// Something that can be set, whatever it is set of.
#[derive(Clone, Copy, Debug)]
pub struct Definition {
    /// Names it in the stored record. Never given to another setting.
    pub id: u8,
    /// Its name at every door.
    pub name: &'static str,
    /// Its unit; empty if it has none.
    pub unit: &'static str,
    /// What its values are.
    pub form: Form,
    /// Its description.
    pub text: &'static str,
}

/// Something that can be set of a `T`.
#[derive(Clone, Copy, Debug)]
pub struct Setting<T> {
    /// What it is.
    pub definition: Definition,
    /// Its value.
    pub get: fn(&T) -> i64,
    /// Sets it to a value that its form allows.
    pub set: fn(&mut T, i64),
}

impl<T> Deref for Setting<T> {
    type Target = Definition;

    fn deref(&self) -> &Definition {
        &self.definition
    }
}

/// The values of a table's settings, by their places in it. Code that works on any table takes these: it is in an image
/// once, not once for each table.
pub trait Shown {
    /// The setting at this place; `None` behind the last one.
    fn definition(&self, place: usize) -> Option<&'static Definition>;
    /// Its value; 0 behind the last one.
    fn value(&self, place: usize) -> i64;
}

/// The same, to be set.
pub trait Settable: Shown {
    /// Sets it to a value that its form allows.
    fn set(&mut self, place: usize, value: i64);
}

/// Something with its table.
pub struct Tabled<T: 'static, R> {
    table: &'static [Setting<T>],
    of: R,
}

impl<T, R: Borrow<T>> Tabled<T, R> {
    /// This, a reference, by its table.
    pub const fn new(table: &'static [Setting<T>], of: R) -> Self {
        Tabled { table, of }
    }
}

impl<T, R: Borrow<T>> Shown for Tabled<T, R> {
    fn definition(&self, place: usize) -> Option<&'static Definition> {
        self.table.get(place).map(|setting| &setting.definition)
    }

    fn value(&self, place: usize) -> i64 {
        self.table.get(place).map_or(0, |setting| (setting.get)(self.of.borrow()))
    }
}

impl<T, R: BorrowMut<T>> Settable for Tabled<T, R> {
    fn set(&mut self, place: usize, value: i64) {
        if let Some(setting) = self.table.get(place) {
            (setting.set)(self.of.borrow_mut(), value);
        }
    }
}

impl dyn Shown + '_ {
    /// All settings with their places.
    pub fn definitions(&self) -> impl Iterator<Item = (usize, &'static Definition)> {
        (0..).map_while(|place| Some((place, self.definition(place)?)))
    }

    /// The setting with this id, and its place.
    pub fn find(&self, id: u8) -> Option<(usize, &'static Definition)> {
        self.definitions().find(|(_, definition)| definition.id == id)
    }

    /// Whether all values are allowed.
    ///
    /// # Errors
    /// The first that is not.
    pub fn check(&self) -> Result<(), Refusal> {
        self.definitions().try_for_each(|(place, definition)| definition.check(self.value(place)))
    }

    /// Its value in units of `scale`, towards zero.
    pub fn scaled(&self, place: usize, scale: i64) -> i64 {
        self.value(place).checked_div(scale).unwrap_or(0)
    }
}

/// Form of the values of a setting.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// 0 is off, 1 is on.
    Flag,
    /// The position of one of these words. An empty word stands for one that this build does not have.
    Choice(&'static [&'static str]),
    /// One of these numbers.
    OneOf(&'static [u32]),
    /// A number within limits, in units of its last decimal.
    Number {
        /// Smallest value.
        least: i32,
        /// Largest value.
        most: u32,
        /// Number of decimals.
        decimals: u8,
    },
    /// The number of a slot; -1 is none.
    Slot,
    /// Four characters of a text, the first in the highest byte; zeros behind its end.
    Characters,
}

/// Four tildes, the last printable character.
const LAST_CHARACTERS: i64 = 0x7E7E_7E7E;

/// The value for "no slot".
pub const NO_SLOT: i64 = -1;

impl Form {
    /// A number within limits.
    pub const fn number(least: i64, most: i64, decimals: u8) -> Form {
        assert!(least >= i32::MIN as i64 && most >= 0 && most <= u32::MAX as i64, "no limits for a setting");
        Form::Number { least: least as i32, most: most as u32, decimals }
    }

    /// Smallest and largest value. What lies between is not always allowed.
    pub const fn limits(&self) -> (i64, i64) {
        match *self {
            Form::Flag => (0, 1),
            Form::Choice(words) => (0, words.len().saturating_sub(1) as i64),
            Form::OneOf(numbers) => ends(numbers),
            Form::Number { least, most, .. } => (least as i64, most as i64),
            Form::Slot => (NO_SLOT, crate::config::MAX_SLOTS.saturating_sub(1) as i64),
            Form::Characters => (0, LAST_CHARACTERS),
        }
    }

    /// Number of decimals.
    pub const fn decimals(&self) -> u8 {
        match *self {
            Form::Number { decimals, .. } => decimals,
            Form::Flag | Form::Choice(_) | Form::OneOf(_) | Form::Slot | Form::Characters => 0,
        }
    }

    /// Whether this is one of its values.
    pub fn allows(&self, value: i64) -> bool {
        let (least, most) = self.limits();
        match self {
            Form::OneOf(numbers) => numbers.iter().any(|&number| i64::from(number) == value),
            Form::Choice(words) => usize::try_from(value)
                .is_ok_and(|place| words.get(place).is_some_and(|word| !word.is_empty())),
            Form::Characters => u32::try_from(value).is_ok_and(are_characters),
            _ => (least..=most).contains(&value),
        }
    }

    /// Whether this is one of the values of a setting of this name and unit.
    ///
    /// # Errors
    /// The value is not allowed; the error holds the limits.
    #[inline(never)]
    pub fn check(&self, name: &'static str, unit: &'static str, value: i64) -> Result<(), Refusal> {
        match *self {
            _ if self.allows(value) => Ok(()),
            Form::OneOf(allowed) if unit == "bit/s" => {
                Err(Refusal::BitRate { value: u32::try_from(value).unwrap_or(u32::MAX), allowed })
            }
            _ => {
                let (least, most) = self.limits();
                let number = Number { name, unit, value, decimals: self.decimals() };
                Err(Refusal::Range { number, least, most })
            }
        }
    }
}

#[allow(clippy::indexing_slicing, clippy::arithmetic_side_effects, reason = "within the length")]
const fn ends(numbers: &[u32]) -> (i64, i64) {
    let (mut least, mut most, mut at) = (u32::MAX, 0, 0);
    while at < numbers.len() {
        let number = numbers[at];
        least = if number < least { number } else { least };
        most = if number > most { number } else { most };
        at += 1;
    }
    (least as i64, most as i64)
}

impl Definition {
    /// Whether this is one of its values.
    ///
    /// # Errors
    /// The value is not allowed; the error holds the limits.
    pub fn check(&self, value: i64) -> Result<(), Refusal> {
        self.form.check(self.name, self.unit, value)
    }
}

impl<T> Setting<T> {
    /// Its value, as a number with a name.
    pub fn number(&self, of: &T) -> Number {
        Number { name: self.name, unit: self.unit, value: (self.get)(of), decimals: self.form.decimals() }
    }
}

/// A value that a change names, in units of `scale`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Given {
    /// The value.
    pub value: i64,
    /// How much one of them is, in the setting's own unit. What such a door cannot tell stays as it is.
    pub scale: i64,
}

impl Given {
    /// A value in the setting's own unit.
    pub const fn exactly(value: i64) -> Given {
        Given { value, scale: 1 }
    }

    /// The value in the setting's own unit.
    #[inline(never)]
    pub const fn exact(self) -> i64 {
        self.value.saturating_mul(self.scale)
    }
}

/// What a change names: the value of the setting with this id; `None` if the change does not name it.
pub type Named<'a> = &'a dyn Fn(u8) -> Option<Given>;

/// The names of a table's first settings.
#[allow(clippy::indexing_slicing, clippy::arithmetic_side_effects, reason = "runs in the compiler only")]
pub(super) const fn names<T, const N: usize>(table: &[Setting<T>]) -> [&'static str; N] {
    let mut names = [""; N];
    let mut at = 0;
    while at < N {
        names[at] = table[at].definition.name;
        at += 1;
    }
    names
}

/// Sets what a change names. A value that is there already, as far as its door can tell, is left as it is. What is
/// acknowledged reads back: named values that exclude each other are refused.
///
/// # Errors
/// A value that its setting does not have, or that another one of the same change does not allow. `to` is half changed
/// then.
pub fn change(to: &mut dyn Settable, named: Named<'_>) -> Result<(), Refusal> {
    for place in 0.. {
        let Some(definition) = to.definition(place) else { break };
        let Some(given) = named(definition.id) else { continue };
        if (to as &dyn Shown).scaled(place, given.scale) != given.value {
            let value = given.exact();
            definition.check(value)?;
            to.set(place, value);
        }
    }
    read_back(to, named)
}

/// What mixes a word into a fingerprint: turn, exclusive or, multiplication (FxHash, the hash of rustc's own tables). The factor
/// is 2³² over the golden ratio.
const HASH_TURN: u32 = 5;
const HASH_FACTOR: u32 = 0x9E37_79B9;

/// A number that two things share if all their settings are equal, and hardly ever otherwise. `seed` tells things of one
/// kind apart.
pub fn fingerprint(of: &dyn Shown, seed: u8) -> u32 {
    // Word by word: while it runs, with the gateway locked, no driver rises.
    let take = |hash: u32, word: u32| (hash.rotate_left(HASH_TURN) ^ word).wrapping_mul(HASH_FACTOR);
    of.definitions().fold(take(u32::MAX, seed.into()), |hash, (place, definition)| {
        let value = of.value(place) as u64;
        let hash = take(take(hash, definition.id.into()), value as u32);
        take(hash, (value >> u32::BITS) as u32)
    })
}

/// Whether everything that a change names is there.
fn read_back(of: &dyn Shown, named: Named<'_>) -> Result<(), Refusal> {
    let kept =
        |place: usize, id: u8| named(id).is_none_or(|given| of.scaled(place, given.scale) == given.value);
    match of.definitions().find(|&(place, definition)| !kept(place, definition.id)) {
        Some((_, definition)) => Err(Refusal::Excluded(definition.name)),
        None => Ok(()),
    }
}
