//! Groups of digits, marked and separated in any customary way.
//!
//! Brackets and quotes have to be closed. Between two bytes there is one of the separators `, ; : - . _` at most, besides
//! blanks, `|`, brackets and quotes; two of them have lost a byte between them. `: - . _` have a byte on each side, too:
//! what begins with a colon is Intel HEX or Modbus ASCII, what begins with a minus is a number.

use super::{ambiguous, bytes, is_blank, literal, not_hex, odd, unclosed};
use crate::bad::Bad;

/// Marks that may stand before a group; the longer ones first.
const MARKS: [&str; 9] = ["b#16#", "16#", "&#x", "&h", "0x", "\\x", "$", "#", "%"];
/// What a constant of source code may end with.
const SUFFIXES: [&str; 5] = ["u8", "uy", "ul", "u", "l"];
/// Casts before a constant of source code.
const CASTS: [&str; 8] = ["byte", "char", "u8", "uchar", "uint8_t", "unsigned char", "sbyte", "uint8"];

/// Brackets and quotes, and what closes them.
const PAIRS: [(char, char); 10] = [
    ('(', ')'),
    ('[', ']'),
    ('{', '}'),
    ('<', '>'),
    ('"', '"'),
    ('\'', '\''),
    ('`', '`'),
    ('“', '”'),
    ('‘', '’'),
    ('«', '»'),
];
/// Pairs before this one are brackets.
const BRACKETS: usize = 4;

/// The bytes that the text shows.
///
/// # Errors
/// What is wrong, and where.
pub fn parse(text: &[char]) -> Result<Vec<u8>, Bad> {
    let mut scan = Scan { text, at: 0, bytes: Vec::new(), open: Vec::new(), separator: None };
    while let Some(&character) = text.get(scan.at) {
        scan.step(character)?;
    }
    if let Some(&(_, at)) = scan.open.last() {
        return Err(unclosed(text, at));
    }
    scan.end_of_bytes()?;
    Ok(scan.bytes)
}

struct Scan<'a> {
    text: &'a [char],
    at: usize,
    bytes: Vec<u8>,
    /// What closes the brackets and quotes that are open, and where they are.
    open: Vec<(char, usize)>,
    /// Where a separator stands that no byte has followed yet.
    separator: Option<usize>,
}

impl Scan<'_> {
    fn step(&mut self, character: char) -> Result<(), Bad> {
        if self.open.last().is_some_and(|&(close, _)| close == character) {
            self.end_of_bytes()?;
            self.open.pop();
            self.at += 1;
            return Ok(());
        }
        let is_reference = character == '&' && self.goes_on("&[");
        if is_blank(character) || character == '|' || is_reference || self.is_comment() {
            self.at += 1;
            return Ok(());
        }
        if self.group()? || self.words()? {
            return Ok(());
        }
        if let Some(pair) = PAIRS.iter().position(|&(open, _)| open == character) {
            return self.open(pair);
        }
        if is_separator(character) {
            return self.separate(character);
        }
        Err(not_hex(self.text, self.at))
    }

    /// No byte follows, in these brackets or at all: a comma may stand here.
    fn end_of_bytes(&mut self) -> Result<(), Bad> {
        match self.separator.take() {
            Some(at) if needs_bytes(self.text[at]) => Err(not_hex(self.text, at)),
            _ => Ok(()),
        }
    }

    fn rest(&self) -> &[char] {
        self.text.get(self.at..).unwrap_or_default()
    }

    /// Whether the text goes on like this, in any case.
    fn goes_on(&self, with: &str) -> bool {
        starts_with(self.rest(), with)
    }

    /// Skips a comment but its last character.
    fn is_comment(&mut self) -> bool {
        let end = if self.goes_on("/*") {
            self.rest().windows(2).position(|pair| pair == ['*', '/']).map(|end| end + 1)
        } else if self.goes_on("//") {
            self.rest().iter().position(|&character| character == '\n').or(Some(self.rest().len() - 1))
        } else {
            None
        };
        self.at += end.unwrap_or(0);
        end.is_some()
    }

    /// Takes a group of digits with what marks it; says whether there is one.
    fn group(&mut self) -> Result<bool, Bad> {
        let start = self.at;
        let mark = self.mark();
        let rest = &self.rest()[mark..];
        let escape = mark == 2 && self.goes_on("\\x");
        let longest = if escape { 2 } else { rest.len() };
        let count = rest.iter().take(longest).take_while(|digit| digit.is_ascii_hexdigit()).count();
        let (digits, behind) = rest.split_at(count);
        let suffix = self.suffix(mark, behind);
        let is_quoted = matches!(behind.first(), Some('"' | '\'' | '\\'));
        if mark == 0 && is_quoted && literal::is_prefix(&digits.iter().collect::<String>()) {
            return Ok(false);
        }
        if escape && behind.first().is_some_and(char::is_ascii_hexdigit) {
            return Err(ambiguous("a character, or more digits", start + mark + count));
        }
        if mark == 0 && (count == 0 || suffix.is_none() && is_word(behind)) {
            // A letter that is a digit, too, may begin a word.
            let letter = rest.first().is_some_and(char::is_ascii_alphabetic);
            return if count == 0 || letter { Ok(false) } else { Err(not_hex(self.text, start + count)) };
        }
        let Some(suffix) = suffix.filter(|_| !escape).or(escape.then_some(0)) else {
            return Err(not_hex(self.text, start + mark + count));
        };
        if count == 0 {
            return Err(odd(&self.text[start..start + mark], start));
        }
        let Some(bytes) = bytes(digits) else { return Err(odd(digits, start + mark)) };
        if mark == 0 && suffix == 0 && is_binary(digits) {
            return Err(ambiguous("a binary number, or bytes beginning with 0B", start));
        }
        self.bytes.extend(bytes);
        self.separator = None;
        self.at = start + mark + count + suffix;
        Ok(true)
    }

    /// Characters of the mark that a group begins with.
    fn mark(&self) -> usize {
        let rest = self.rest();
        // As Verilog has it: how many bits, and 'h.
        let width = rest.iter().take_while(|digit| digit.is_ascii_digit()).count();
        if starts_with(&rest[width..], "'h") {
            return width + 2;
        }
        MARKS.iter().find(|mark| self.goes_on(mark)).map_or(0, |mark| mark.len())
    }

    /// Characters of what ends a group; `None` if it does not end there.
    fn suffix(&self, mark: usize, behind: &[char]) -> Option<usize> {
        let suffixes: &[&str] = match mark {
            0 => &["h"],
            2 => &SUFFIXES,
            _ => &[],
        };
        let found =
            suffixes.iter().find(|suffix| starts_with(behind, suffix)).map_or(0, |suffix| suffix.len());
        let next = behind.get(found);
        // After an h, the next group may follow at once.
        let ends = next.is_none_or(|next| {
            !next.is_alphanumeric() || found == 1 && mark == 0 && next.is_ascii_hexdigit()
        });
        ends.then_some(found)
    }

    /// Skips words that lead to an opening bracket or quote, or a cast; says whether there are any.
    fn words(&mut self) -> Result<bool, Bad> {
        let rest = self.rest();
        if !rest.first().is_some_and(|first| first.is_ascii_alphabetic()) {
            return Ok(false);
        }
        let mut end = 0;
        while let Some(&character) = rest.get(end) {
            let begins = end == 0 || !is_in_word(rest[end - 1]);
            if character.is_ascii_digit() && begins {
                // Bytes are no words.
                break;
            }
            match character {
                '[' => match rest[end..].iter().position(|&character| character == ']') {
                    // The size of an array.
                    Some(size) if rest[end + 1..end + size].iter().all(char::is_ascii_digit) => {
                        end += size + 1
                    }
                    _ => break,
                },
                ' ' | '.' | '!' | '*' | '&' => end += 1,
                _ if is_in_word(character) => end += 1,
                _ => break,
            }
        }
        let words: String = rest[..end].iter().collect();
        let words = words.trim();
        let next = rest.get(end).copied();
        let bytes_literal = literal::is_prefix(words);
        let is_code = words.chars().any(|letter| letter.is_ascii_alphabetic() && !letter.is_ascii_hexdigit());
        match next {
            Some(')') if CASTS.iter().any(|cast| cast.eq_ignore_ascii_case(words)) => {}
            Some('=') if is_code => end += 1,
            Some('(' | '[' | '{') if is_code => {}
            Some('"' | '\'') if bytes_literal => return self.literal(end, true),
            // As SQL has it.
            Some('"' | '\'') if ["x", "h"].iter().any(|mark| mark.eq_ignore_ascii_case(words)) => {}
            // A shell has taken the quotes away.
            Some('\\') if bytes_literal => {}
            _ => return Ok(false),
        }
        self.at += end;
        Ok(true)
    }

    fn open(&mut self, pair: usize) -> Result<(), Bad> {
        let (open, close) = PAIRS[pair];
        if pair >= BRACKETS {
            let inside = &self.rest()[1..];
            let end = inside.iter().position(|&character| character == close).unwrap_or(inside.len());
            if inside[..end].contains(&'\\') {
                return self.literal(0, false).map(drop);
            }
        }
        debug_assert_eq!(self.text[self.at], open);
        self.open.push((close, self.at));
        self.at += 1;
        Ok(())
    }

    /// Takes a text with escapes, whose first quote is `ahead` characters ahead.
    fn literal(&mut self, ahead: usize, is_marked: bool) -> Result<bool, Bad> {
        let quote = self.at + ahead;
        let (bytes, length) = literal::parse(self.text, quote, is_marked)?;
        self.bytes.extend(bytes);
        self.separator = None;
        self.at = quote + length;
        Ok(true)
    }

    fn separate(&mut self, character: char) -> Result<(), Bad> {
        if let Some(before) = self.separator {
            let message = format!("nothing between the separators at {} and {}", before + 1, self.at + 1);
            return Err(Bad::new("missing", message).with("position", self.at + 1));
        }
        if self.bytes.is_empty() && needs_bytes(character) {
            return Err(not_hex(self.text, self.at));
        }
        self.separator = Some(self.at);
        self.at += 1;
        Ok(())
    }
}

fn is_separator(character: char) -> bool {
    matches!(character, ',' | ';') || needs_bytes(character)
}

/// Separators that stand between two bytes only; dashes as documents have them among them.
fn needs_bytes(character: char) -> bool {
    matches!(character, ':' | '-' | '.' | '_' | '\u{2010}'..='\u{2014}' | '\u{2212}' | '·')
}

fn is_in_word(character: char) -> bool {
    character.is_ascii_alphanumeric() || character == '_'
}

/// Whether a word goes on here.
fn is_word(text: &[char]) -> bool {
    text.first().is_some_and(|&character| is_in_word(character) && character != '_')
        || starts_with(text, "_") && text.get(1).is_some_and(|next| !next.is_ascii_hexdigit())
}

fn starts_with(text: &[char], with: &str) -> bool {
    let mut text = text.iter();
    with.chars().all(|expected| text.next().is_some_and(|found| found.eq_ignore_ascii_case(&expected)))
}

/// `0b` and eight binary digits.
fn is_binary(digits: &[char]) -> bool {
    let [zero, b, bits @ ..] = digits else { return false };
    (*zero, b.to_ascii_lowercase()) == ('0', 'b')
        && bits.len() == 8
        && bits.iter().all(|bit| matches!(bit, '0' | '1'))
}
