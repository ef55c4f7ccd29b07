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
const MOST: u32 = 12;

/// An option that takes a value, by its letter or by its name.
#[derive(Clone, Copy)]
pub struct Opt(pub Option<u8>, pub &'static str);

/// A word, or an option without its value.
#[derive(Clone, Copy)]
struct Part<'a> {
    kind: Kind,
    text: &'a str,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Word,
    /// Its text is the letter.
    Short,
    /// Its text is the name.
    Long,
    /// What no line may contain: several letters behind a minus, something else behind it, quotation marks that are not closed
    /// or within a word.
    Letters,
    Minus,
    Quotes,
}

/// The rest of a line. It is taken apart anew for whoever looks for a word: a list of its parts would be on the stack below
/// every command.
pub struct Typed<'a> {
    line: &'a str,
    /// Parts that the command has fetched, a bit each.
    fetched: u16,
    /// `--yes`: the command needs no confirmation.
    pub yes: bool,
    /// Tell about the command instead.
    pub help: bool,
}
const _: () = assert!(MOST <= u16::BITS);

/// A part that is looked for, among those that were not fetched.
#[derive(Clone, Copy)]
enum Wanted {
    Any,
    Word,
    Option(Opt),
    /// The one of this bit.
    At(u16),
}

impl<'a> Typed<'a> {
    /// An empty line.
    pub fn new() -> Typed<'a> {
        Typed { line: "", fetched: 0, yes: false, help: false }
    }

    /// Takes what follows the name of the command, if it is well formed.
    pub fn take(&mut self, line: &'a str) -> Result<(), Mistake<'a>> {
        let mut parts = Parts::of(line);
        let mut count = 0_u32;
        while let Some(part) = parts.next() {
            if count == MOST || matches!(part.kind, Kind::Letters | Kind::Minus | Kind::Quotes) {
                return Err(unexpected(part));
            }
            count = count.wrapping_add(1);
        }
        (self.line, self.yes, self.help) = (line, parts.yes, parts.help);
        Ok(())
    }

    #[inline(never)]
    fn find(&self, wanted: Wanted) -> Option<(u16, Part<'a>)> {
        let mut parts = Parts::of(self.line);
        let mut bit = 1_u16;
        while let Some(part) = parts.next() {
            let is_wanted = match (wanted, part.kind) {
                (Wanted::Any, _) | (Wanted::Word, Kind::Word) => true,
                (Wanted::Option(Opt(letter, _)), Kind::Short) => part.text.bytes().next() == letter,
                (Wanted::Option(Opt(_, name)), Kind::Long) => part.text == name,
                (Wanted::At(place), _) => bit == place,
                _ => false,
            };
            if is_wanted && self.fetched & bit == 0 {
                return Some((bit, part));
            }
            bit = bit.wrapping_shl(1);
        }
        None
    }

    /// The next word, if there is one.
    pub fn next(&mut self) -> Option<&'a str> {
        let (bit, part) = self.find(Wanted::Word)?;
        self.fetched |= bit;
        Some(part.text)
    }

    /// Whether words follow.
    pub fn has_more(&self) -> bool {
        self.find(Wanted::Word).is_some()
    }

    /// The value of an option. To be called before the words are fetched, or the value is taken for one of them.
    pub fn option(&mut self, option: Opt) -> Result<Option<&'a str>, Mistake<'a>> {
        let Some((bit, _)) = self.find(Wanted::Option(option)) else { return Ok(None) };
        match self.find(Wanted::At(bit.wrapping_shl(1))) {
            Some((value, part)) if part.kind == Kind::Word => {
                self.fetched |= bit | value;
                Ok(Some(part.text))
            }
            _ => Err(Mistake { row: MISSING, value: option.1 }),
        }
    }

    /// The error for words and options that the command has not fetched.
    pub fn rest(&self) -> Option<Mistake<'a>> {
        self.find(Wanted::Any).map(|(_, part)| unexpected(part))
    }
}

fn unexpected(part: Part<'_>) -> Mistake<'_> {
    let row = match part.kind {
        Kind::Short | Kind::Letters => UNEXPECTED_LETTER,
        Kind::Long => UNEXPECTED_NAME,
        Kind::Word => UNEXPECTED_WORD,
        Kind::Minus => BARE_MINUS,
        Kind::Quotes => QUOTES,
    };
    Mistake { row, value: part.text }
}

/// Takes a line apart.
struct Parts<'a> {
    rest: &'a str,
    /// `--` has come: nothing is an option any more.
    no_options: bool,
    yes: bool,
    help: bool,
}

impl<'a> Parts<'a> {
    fn of(line: &'a str) -> Parts<'a> {
        Parts { rest: line, no_options: false, yes: false, help: false }
    }

    #[inline(never)]
    fn next(&mut self) -> Option<Part<'a>> {
        loop {
            let line = self.rest.trim_ascii_start();
            let quoted = line.strip_prefix('"');
            let (text, behind) = match quoted {
                Some(line) => split_before(line, b'"'),
                None => split_before(line, b' '),
            };
            let behind = match quoted {
                Some(_) => behind.strip_prefix('"'),
                None => Some(behind).filter(|_| text.bytes().all(|byte| byte != b'"')),
            };
            let behind = behind.filter(|behind| behind.is_empty() || behind.starts_with(' '));
            let Some(behind) = behind else { return Some(Part { kind: Kind::Quotes, text }) };
            self.rest = behind;
            let (kind, text) = match text {
                _ if quoted.is_some() => (Kind::Word, text),
                "" => return None,
                _ if self.no_options => (Kind::Word, text),
                "--" => {
                    self.no_options = true;
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
                _ => option(text),
            };
            return Some(Part { kind, text });
        }
    }
}

/// What a word without quotation marks is, and its text.
fn option(text: &str) -> (Kind, &str) {
    if let Some(name) = text.strip_prefix("--") {
        return (Kind::Long, name);
    }
    match text.strip_prefix('-') {
        Some(letter) if !letter.is_empty() => {
            let kind = match letter.as_bytes() {
                [first, ..] if !first.is_ascii_alphabetic() => Kind::Minus,
                [_] => Kind::Short,
                _ => Kind::Letters,
            };
            (kind, letter)
        }
        _ => (Kind::Word, text),
    }
}

/// The name of the command, and what follows it.
pub fn split(line: &str) -> (&str, &str) {
    split_before(line.trim_ascii(), b' ')
}
