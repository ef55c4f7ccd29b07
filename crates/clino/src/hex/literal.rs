//! A text between quotes, with escapes, as Python, C, Rust and JavaScript have it: what is no escape is itself.
//!
//! `\x` takes two digits, as in all of them but C, where a third one would be out of range.

use super::{ambiguous, bytes, not_hex, odd, unclosed};
use crate::bad::Bad;

/// Whether these letters make bytes of the text between the quotes that follow.
pub fn is_prefix(letters: &str) -> bool {
    ["b", "rb", "br", "c"].iter().any(|prefix| prefix.eq_ignore_ascii_case(letters))
}

/// The bytes of the text whose first quote is at `quote`, and how many characters it takes, its quotes included.
/// `is_marked` says that it is a text of bytes for sure.
///
/// # Errors
/// It does not end, has an escape or a character that is no byte, or looks like digits.
pub fn parse(text: &[char], quote: usize, is_marked: bool) -> Result<(Vec<u8>, usize), Bad> {
    let close = match text[quote] {
        '“' => '”',
        '‘' => '’',
        '«' => '»',
        other => other,
    };
    let mut bytes = Vec::new();
    let mut at = quote + 1;
    let mut escapes = 0;
    loop {
        let Some(&character) = text.get(at) else { return Err(unclosed(text, quote)) };
        at += 1;
        if character == close {
            break;
        }
        if character != '\\' {
            let byte =
                u8::try_from(character).ok().filter(u8::is_ascii).ok_or_else(|| not_hex(text, at - 1))?;
            bytes.push(byte);
            continue;
        }
        if matches!(text.get(at..), Some(['\\', 'x' | 'X', high, low, ..]) if high.is_ascii_hexdigit() && low.is_ascii_hexdigit())
        {
            return Err(ambiguous("a backslash and three characters, or an escape that was escaped", at - 1));
        }
        escapes += 1;
        let (byte, length) = escape(text, at)?;
        bytes.push(byte);
        at += length;
    }
    let is_digits = bytes.iter().all(|byte| byte.is_ascii_hexdigit() || byte.is_ascii_whitespace());
    if is_marked && escapes == 0 && is_digits && !bytes.is_empty() {
        return Err(ambiguous("the characters of a text, or the digits of bytes", quote));
    }
    Ok((bytes, at - quote))
}

/// The byte of an escape whose backslash is before `at`, and how many characters it takes.
fn escape(text: &[char], at: usize) -> Result<(u8, usize), Bad> {
    let byte = match text.get(at) {
        Some('x' | 'X') => {
            let digits = text.get(at + 1..).unwrap_or_default();
            let count = digits.iter().take(2).take_while(|digit| digit.is_ascii_hexdigit()).count();
            let byte = bytes(&digits[..count]).and_then(|bytes| bytes.first().copied());
            return byte.map(|byte| (byte, 3)).ok_or_else(|| odd(&text[at - 1..at + 1 + count], at - 1));
        }
        Some('n') => b'\n',
        Some('r') => b'\r',
        Some('t') => b'\t',
        Some('a') => 7,
        Some('b') => 8,
        Some('f') => 12,
        Some('v') => 11,
        // With another digit behind it, it is an octal number in some languages.
        Some('0') if !text.get(at + 1).is_some_and(char::is_ascii_digit) => 0,
        Some('\\') => b'\\',
        Some('\'') => b'\'',
        Some('"') => b'"',
        _ => return Err(not_hex(text, at - 1)),
    };
    Ok((byte, 1))
}
