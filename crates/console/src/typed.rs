//! A line that was typed, taken apart word by word.
//!
//! `COMMAND WORD… -o VALUE --option VALUE --yes`. Options may stand anywhere. Before a number below zero stands `--`, after
//! which nothing is an option: `t7 offset 5 -- -500`.

use embedded_cli::arguments::Arg;
use embedded_cli::command::RawCommand;

use crate::error::Error;

/// Most words and options of a line; no command takes more than eleven.
const MOST: usize = 12;

/// An option that takes a value, by its letter or by its name.
#[derive(Clone, Copy)]
pub struct Opt(pub Option<char>, pub &'static str);

#[derive(Clone, Copy)]
enum Part<'a> {
    Word(&'a str),
    Short(char),
    Long(&'a str),
}

/// What is left of a line.
pub struct Typed<'a> {
    parts: [Option<Part<'a>>; MOST],
    /// The command may do what it would ask about.
    pub yes: bool,
    /// Tell about the command instead.
    pub help: bool,
}

impl<'a> Typed<'a> {
    /// An empty line.
    pub fn new() -> Typed<'a> {
        Typed { parts: [None; MOST], yes: false, help: false }
    }

    /// Takes a line apart.
    pub fn take(&mut self, raw: &RawCommand<'a>) -> Result<(), Error<'a>> {
        let mut places = self.parts.iter_mut();
        for arg in raw.args().args() {
            let part = match arg {
                Ok(Arg::LongOption("yes")) => {
                    self.yes = true;
                    continue;
                }
                Ok(Arg::LongOption("help") | Arg::ShortOption('h')) => {
                    self.help = true;
                    continue;
                }
                Ok(Arg::DoubleDash) => continue,
                Ok(Arg::Value(word)) => Part::Word(word),
                Ok(Arg::ShortOption(letter)) => Part::Short(letter),
                Ok(Arg::LongOption(name)) => Part::Long(name),
                Err(_) => return Err(Error::BareMinus),
            };
            *places.next().ok_or(unexpected(part))? = Some(part);
        }
        Ok(())
    }

    /// The next word, if there is one.
    pub fn next(&mut self) -> Option<&'a str> {
        self.parts.iter_mut().find_map(|part| match *part {
            Some(Part::Word(word)) => {
                *part = None;
                Some(word)
            }
            _ => None,
        })
    }

    /// Whether words follow.
    pub fn has_more(&self) -> bool {
        self.parts.iter().any(|part| matches!(part, Some(Part::Word(_))))
    }

    /// The value of an option. To be called before the words are fetched, or the value is taken for one of them.
    pub fn option(&mut self, Opt(letter, name): Opt) -> Result<Option<&'a str>, Error<'a>> {
        let mut parts = self.parts.iter_mut();
        let found = parts.find(|part| match part {
            Some(Part::Short(typed)) => Some(*typed) == letter,
            Some(Part::Long(typed)) => *typed == name,
            _ => false,
        });
        let Some(found) = found else { return Ok(None) };
        *found = None;
        match parts.next().and_then(Option::take) {
            Some(Part::Word(word)) => Ok(Some(word)),
            _ => Err(Error::Missing(name)),
        }
    }

    /// What nobody has fetched.
    pub fn rest(&self) -> Option<Error<'a>> {
        self.parts.iter().flatten().next().map(|part| unexpected(*part))
    }
}

fn unexpected(part: Part<'_>) -> Error<'_> {
    match part {
        Part::Short(letter) => Error::UnexpectedLetter(letter),
        Part::Long(name) => Error::Unexpected("--", name),
        Part::Word(word) => Error::Unexpected("", word),
    }
}
