//! A line that was typed, taken apart word by word.
//!
//! `COMMAND WORD… -o VALUE --option VALUE --yes`. Options may stand anywhere. `--` stands before a negative number; after it
//! nothing is an option: `t7 offset 5 -- -500`. A word with blanks in it, or with nothing in it, stands in quotation
//! marks; between them no character has a meaning of its own.

use crate::error::{
    BARE_MINUS, MISSING, Mistake, QUOTES, UNEXPECTED_LETTER, UNEXPECTED_NAME, UNEXPECTED_WORD,
};
use crate::split::split_before;

/// Most words and options of a line; no command takes more than eleven.
const MOST: usize = 12;

/// An option that takes a value, by its letter or by its name.
#[derive(Clone, Copy)]
pub struct Opt(pub Option<u8>, pub &'static str);

#[derive(Clone, Copy)]
enum Part<'a> {
    Word(&'a str),
    /// Its letter.
    Short(&'a str),
    Long(&'a str),
}

/// The rest of a line.
pub struct Typed<'a> {
    parts: [Option<Part<'a>>; MOST],
    /// `--yes`: the command needs no confirmation.
    pub yes: bool,
    /// Tell about the command instead.
    pub help: bool,
}

impl<'a> Typed<'a> {
    /// An empty line.
    pub fn new() -> Typed<'a> {
        Typed { parts: [None; MOST], yes: false, help: false }
    }

    /// Takes apart what follows the name of the command.
    #[inline(never)]
    pub fn take(&mut self, mut rest: &'a str) -> Result<(), Mistake<'a>> {
        let mut places = self.parts.iter_mut();
        let mut options = true;
        while let Some(word) = next_word(&mut rest)? {
            let part = match word.text {
                text if word.quoted || !options => Part::Word(text),
                "--" => {
                    options = false;
                    continue;
                }
                "--yes" => {
                    self.yes = true;
                    continue;
                }
                "--help" | "-h" => {
                    self.help = true;
                    continue;
                }
                text => match text.strip_prefix("--") {
                    Some(name) => Part::Long(name),
                    None => match text.strip_prefix('-') {
                        Some(letter) if !letter.is_empty() => Part::Short(one_letter(letter)?),
                        _ => Part::Word(text),
                    },
                },
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
    pub fn option(&mut self, Opt(letter, name): Opt) -> Result<Option<&'a str>, Mistake<'a>> {
        let mut parts = self.parts.iter_mut();
        let found = parts.find(|part| match part {
            Some(Part::Short(typed)) => typed.bytes().next() == letter,
            Some(Part::Long(typed)) => *typed == name,
            _ => false,
        });
        let Some(found) = found else { return Ok(None) };
        *found = None;
        match parts.next().and_then(Option::take) {
            Some(Part::Word(word)) => Ok(Some(word)),
            _ => Err(Mistake { row: MISSING, value: name }),
        }
    }

    /// The error for words and options that the command has not fetched.
    pub fn rest(&self) -> Option<Mistake<'a>> {
        self.parts.iter().flatten().next().map(|part| unexpected(*part))
    }
}

fn unexpected(part: Part<'_>) -> Mistake<'_> {
    match part {
        Part::Short(value) => Mistake { row: UNEXPECTED_LETTER, value },
        Part::Long(value) => Mistake { row: UNEXPECTED_NAME, value },
        Part::Word(value) => Mistake { row: UNEXPECTED_WORD, value },
    }
}

/// A word of a line.
struct Word<'a> {
    text: &'a str,
    quoted: bool,
}

/// Takes the next word off a line.
fn next_word<'a>(rest: &mut &'a str) -> Result<Option<Word<'a>>, Mistake<'a>> {
    let line = rest.trim_ascii_start();
    let quoted = line.strip_prefix('"');
    let (text, behind) = match quoted {
        Some(line) => {
            let (text, behind) = split_before(line, b'"');
            (text, behind.strip_prefix('"').ok_or(UNQUOTED)?)
        }
        None => split_before(line, b' '),
    };
    let is_word = quoted.is_some() || text.bytes().all(|byte| byte != b'"');
    if !is_word || !(behind.is_empty() || behind.starts_with(' ')) {
        return Err(UNQUOTED);
    }
    *rest = behind;
    Ok((quoted.is_some() || !text.is_empty()).then_some(Word { text, quoted: quoted.is_some() }))
}

const UNQUOTED: Mistake<'static> = Mistake { row: QUOTES, value: "" };

/// The letter of an option.
fn one_letter(letter: &str) -> Result<&str, Mistake<'_>> {
    let is_letter = letter.bytes().next().is_some_and(|first| first.is_ascii_alphabetic());
    match letter.len() {
        _ if !is_letter => Err(Mistake { row: BARE_MINUS, value: "" }),
        1 => Ok(letter),
        _ => Err(Mistake { row: UNEXPECTED_LETTER, value: letter }),
    }
}

/// The name of the command, and what follows it.
pub fn split(line: &str) -> (&str, &str) {
    split_before(line.trim_ascii(), b' ')
}
