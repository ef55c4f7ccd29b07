//! Lists of words, one of which is expected: what errors name, what is looked up, what Tab completes.

use crate::command;
use crate::rows::{Table, has_name};

/// Words, one of which is expected.
#[derive(Clone, Copy)]
pub enum Choice {
    /// These; an empty one stands for one that this build does not have.
    Words(&'static [&'static str]),
    /// Names of commands.
    Commands,
    /// Names of settings.
    Settings(Table),
}

impl Choice {
    /// No words.
    pub const NOTHING: Choice = Choice::Words(&[]);

    /// The word at this place; `None` behind the last.
    pub fn get(self, place: usize) -> Option<&'static str> {
        match self {
            Choice::Words(words) => words.get(place).copied(),
            Choice::Commands => command::name_at(place),
            Choice::Settings(table) => table(place).filter(|row| has_name(row)).map(|row| row.name),
        }
    }

    /// All that this build has.
    pub fn all(self) -> impl Iterator<Item = &'static str> {
        self.places().filter(|word| !word.is_empty())
    }

    fn places(self) -> impl Iterator<Item = &'static str> {
        (0_usize..).map_while(move |place| self.get(place))
    }

    /// Where a word stands.
    #[inline(never)]
    pub fn place(self, word: &str) -> Option<usize> {
        self.places().position(|name| name == word && !name.is_empty())
    }
}
