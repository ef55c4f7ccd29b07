//! A line on its way from the port to a command, and the one judge of it.
//!
//! **Invariant: only lines that were typed, whole, are carried out.** People and programs go through this type; nothing else
//! hands text to a command ([`Line::judge`]). Any event that may have removed, altered or merged characters spoils the line
//! ([`Line::spoil`]), and a line once spoilt stays so until its end or Ctrl-C, whatever is typed, deleted or recalled after
//! it. A spoilt line is never carried out and answered by exactly one error, which names the first reason and counts the
//! characters concerned.
//!
//! | reason | spoils |
//! |---|---|
//! | `lost` | characters were lost before this one: full queue, overrun, a start or a question that cut a line in two |
//! | `receiver` | the receiver reported a framing, noise or parity error: the character may have been any other, a line end too |
//! | `not_ascii` | 0x80 to 0xFF: a dash, a quotation mark, a blank from a document; a byte order mark; noise |
//! | `control` | a control character that is no editing key here |
//! | `flow_control` | XON or XOFF, which this port does not use; `1` and `3` with one bit turned |
//! | `sequence` | a control sequence that is cut short or no key, so that it may have swallowed text |
//! | `too_long` | more than [`LONGEST_LINE`] characters |
//! | `early` | typed while something else was waited for: the answer to a question, the end of `watch` |
//! | `left` | left unfinished for the idle time (program) or ten of it (person): another may go on with it |
//! | `check` | the line check is wrong, malformed or missing |
//!
//! A loss or an unreadable character may hide a line end. The line in hand is therefore spoilt up to the *next* line end:
//! what a lost line end would have merged ends there, and is refused with it.
//!
//! What no receiver can see, a printable character that became another one on the wire, only a line check can tell:
//! `LINE*hh` as NMEA 0183 has it (exclusive or of all characters before `*`, two hexadecimal digits), or `LINE*hhhh` with the
//! CRC-16 of the Modbus port (exclusive or does not see a pair of equal characters that is missing). `*` has no other use.
//!
//! Lines of the gateway's own that an echoing port sends back are neither carried out nor answered ([`Verdict::Own`]).

use clino_modbus::crc;

use crate::split::split_before;

/// Longest line that can be typed or sent, line check included.
pub const LONGEST_LINE: usize = 80;
/// What stands before a line that a person types.
pub const PROMPT: &str = "clino> ";
/// What stands before that while the settings in force are not saved.
pub const NOT_SAVED: &str = "not saved, ";
/// What an error begins with for people.
pub const ERROR: &str = "error: ";

/// Why a line is not carried out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    Lost,
    Receiver,
    NotAscii,
    Control,
    FlowControl,
    Sequence,
    TooLong,
    Early,
    Left,
    Check,
}

impl Reason {
    /// Its name for programs.
    pub const fn name(self) -> &'static str {
        match self {
            Reason::Lost => "lost",
            Reason::Receiver => "receiver",
            Reason::NotAscii => "not_ascii",
            Reason::Control => "control",
            Reason::FlowControl => "flow_control",
            Reason::Sequence => "sequence",
            Reason::TooLong => "too_long",
            Reason::Early => "early",
            Reason::Left => "left",
            Reason::Check => "check",
        }
    }

    /// The fault of the counted characters, in words.
    pub const fn words(self) -> &'static str {
        match self {
            Reason::Lost => "characters lost",
            Reason::Receiver => "characters not readable",
            Reason::NotAscii => "characters that are not ASCII",
            Reason::Control => "control characters",
            Reason::FlowControl => "XON or XOFF, which are not used here",
            Reason::Sequence => "control sequences of no known key",
            Reason::TooLong => "characters more than 80",
            Reason::Early => "characters too early",
            Reason::Left => "characters left unfinished too long",
            Reason::Check => "characters with a wrong or missing line check",
        }
    }
}

/// Damage of a line: the first reason, and the characters concerned, at least.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Damage {
    pub reason: Reason,
    pub characters: u16,
}

/// How much a line check proves, least first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Check {
    None,
    /// `*hh`
    Xor,
    /// `*hhhh`
    Crc,
}

/// Verdict on a line at its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict<'a> {
    /// Nothing was typed.
    Empty,
    /// This was typed, whole; and how it was checked.
    Whole(&'a str, Check),
    /// It is not what was typed, or cannot be known to be.
    Damaged(Damage),
    /// A line of the gateway's own: a port or a terminal echoes what it receives.
    Own,
}

/// A line that is being typed.
pub struct Line {
    bytes: [u8; LONGEST_LINE],
    length: usize,
    /// Characters before the cursor.
    cursor: usize,
    /// The last character that was typed, if the line has no room for it.
    last: u8,
    damage: Option<Damage>,
}

impl Line {
    /// A line of which nothing is typed.
    pub const fn new() -> Line {
        Line { bytes: [0; LONGEST_LINE], length: 0, cursor: 0, last: 0, damage: None }
    }

    /// Begins anew.
    pub fn clear(&mut self) {
        (self.length, self.cursor, self.last, self.damage) = (0, 0, 0, None);
    }

    /// Whether nothing has come of it, neither text nor damage.
    pub fn is_untouched(&self) -> bool {
        self.length == 0 && self.damage.is_none()
    }

    /// Whether it is damaged.
    pub fn is_damaged(&self) -> bool {
        self.damage.is_some()
    }

    /// Text typed so far.
    pub fn text(&self) -> &str {
        let text = self.bytes.get(..self.length).map(str::from_utf8);
        // Only ASCII is ever inserted.
        text.and_then(Result::ok).unwrap_or("")
    }

    /// Text before the cursor.
    pub fn before_cursor(&self) -> &str {
        self.text().get(..self.cursor).unwrap_or("")
    }

    /// Characters of it.
    pub fn length(&self) -> usize {
        self.length
    }

    /// Characters before the cursor.
    pub fn cursor(&self) -> usize {
        self.cursor
    }

    /// Moves the cursor.
    pub fn go(&mut self, to: usize) {
        self.cursor = to.min(self.length);
    }

    /// From now on it is damaged.
    #[inline(never)]
    pub fn spoil(&mut self, reason: Reason, characters: u16) {
        let damage = self.damage.get_or_insert(Damage { reason, characters: 0 });
        damage.characters = damage.characters.saturating_add(characters);
    }

    /// Puts a printable ASCII character at the cursor.
    pub fn insert(&mut self, byte: u8) {
        self.last = byte;
        if self.length >= LONGEST_LINE {
            self.spoil(Reason::TooLong, 1);
            return;
        }
        let mut carried = byte;
        let moved = self.length.saturating_sub(self.cursor).saturating_add(1);
        for place in self.bytes.iter_mut().skip(self.cursor).take(moved) {
            core::mem::swap(place, &mut carried);
        }
        self.length = self.length.saturating_add(1);
        self.cursor = self.cursor.saturating_add(1);
    }

    /// Removes what stands between `from` and `to`; the cursor is then at `from`.
    pub fn remove(&mut self, from: usize, to: usize) {
        let to = to.min(self.length);
        for _ in from..to {
            let mut carried = 0;
            let moved = self.length.saturating_sub(from);
            for place in self.bytes.iter_mut().skip(from).take(moved).rev() {
                core::mem::swap(place, &mut carried);
            }
            self.length = self.length.saturating_sub(1);
        }
        self.cursor = from.min(self.length);
    }

    /// The verdict at the end of the line.
    pub fn judge(&self) -> Verdict<'_> {
        let text = self.text();
        let begins = |with: &str| text.starts_with(with.trim_ascii_end());
        let ends = if self.length < LONGEST_LINE { text.ends_with('}') } else { self.last == b'}' };
        if begins("{") || ends || begins(ERROR) || begins(PROMPT) || begins(NOT_SAVED) {
            return Verdict::Own;
        }
        if let Some(damage) = self.damage {
            return Verdict::Damaged(damage);
        }
        if text.trim_ascii().is_empty() {
            return Verdict::Empty;
        }
        match checked(text) {
            Some((text, check)) => Verdict::Whole(text, check),
            None => Verdict::Damaged(Damage { reason: Reason::Check, characters: self.length as u16 }),
        }
    }
}

/// A line without its check, if that is right.
fn checked(text: &str) -> Option<(&str, Check)> {
    let (body, check) = split_before(text, b'*');
    let Some(digits) = check.strip_prefix('*') else { return Some((text, Check::None)) };
    let hexadecimal = digits.bytes().all(|digit| digit.is_ascii_hexdigit());
    let told = u16::from_str_radix(digits, 16).ok().filter(|_| hexadecimal)?;
    let (check, computed) = match digits.len() {
        2 => (Check::Xor, body.bytes().fold(0, |sum, byte| sum ^ u16::from(byte))),
        4 => (Check::Crc, crc::over(body.as_bytes())),
        _ => return None,
    };
    (told == computed).then_some((body, check))
}
