//! Bytes as text, in any customary way of writing them, and back.
//!
//! | way | examples |
//! |---|---|
//! | groups of whole bytes, apart by blanks, `, ; : - . _` `\|`, quotes or brackets | `05 06`, `0506`, `05:06`, `[05][06]`, `{05,06}` |
//! | with a mark before each group, or an `h` behind it | `0x05`, `\x05`, `$05`, `#05`, `%05`, `&H05`, `16#05`, `8'h05`, `05h` |
//! | as source code | `uint8_t a[] = {0x05, (byte)0x83};`, `bytes.fromhex("0506")`, `vec![0x05]` |
//! | a text with escapes | `b"\x05N\xff"` |
//! | a dump with its offset and its ASCII column | what `xxd`, `hexdump -C`, `od -t x1`, `tcpdump -X`, Wireshark and `candump` print |
//!
//! Any case; blanks are all that Unicode has, byte order marks and zero-width spaces among them. What can be read in two
//! ways is refused, with its place; so is what looks as if something was lost: half a byte, an open bracket,
//! two commas.

use std::fmt::Write as _;

use crate::bad::Bad;

mod dump;
mod literal;
mod scan;

/// The bytes that the text shows, which are at least one.
///
/// # Errors
/// What is no hexadecimal text, and at which character (the first is 1).
pub fn parse(text: &[u8]) -> Result<Vec<u8>, Bad> {
    if let Some(bytes) = pairs(text) {
        return Ok(bytes);
    }
    let text = String::from_utf8_lossy(text);
    // A mark of the byte order is no character of the text.
    let text: Vec<char> = text.strip_prefix('\u{FEFF}').unwrap_or(&text).chars().collect();
    let bytes = match dump::parse(&text)? {
        Some(bytes) => bytes,
        None => scan::parse(&text)?,
    };
    if bytes.is_empty() {
        return Err(Bad::new("empty", "no bytes"));
    }
    Ok(bytes)
}

/// The bytes of a text that is written as most are, which is quick: two digits each, one blank between them.
fn pairs(text: &[u8]) -> Option<Vec<u8>> {
    let digit = |character: u8| char::from(character).to_digit(16);
    let byte = |pair: &[u8]| match *pair {
        [high, low] | [high, low, b' '] => u8::try_from(digit(high)? << 4 | digit(low)?).ok(),
        _ => None,
    };
    (!text.is_empty()).then(|| text.chunks(3).map(byte).collect()).flatten()
}

/// The usual way to show bytes: two upper-case digits each, separated by blanks.
pub fn show(bytes: &[u8]) -> String {
    let mut text = String::with_capacity(bytes.len() * 3);
    for byte in bytes {
        let blank = if text.is_empty() { "" } else { " " };
        // Writing to a string cannot fail.
        let _ = write!(text, "{blank}{byte:02X}");
    }
    text
}

pub fn is_separator(character: u8) -> bool {
    character.is_ascii_whitespace() || character == b','
}

/// The digits without the `0x` that may stand before them.
pub fn without_prefix(group: &[u8]) -> Option<&[u8]> {
    group.strip_prefix(b"0x").or_else(|| group.strip_prefix(b"0X"))
}

/// What Unicode calls white space, and what takes no room at all.
fn is_blank(character: char) -> bool {
    character.is_whitespace() || matches!(character, '\u{FEFF}' | '\u{200B}'..='\u{200D}' | '\u{2060}')
}

/// The bytes of these digits, if they are whole.
fn bytes(digits: &[char]) -> Option<Vec<u8>> {
    let values: Option<Vec<u8>> =
        digits.iter().map(|digit| digit.to_digit(16).and_then(|value| u8::try_from(value).ok())).collect();
    let values = values?;
    let (pairs, rest) = values.as_chunks();
    rest.is_empty().then(|| pairs.iter().map(|&[high, low]| high << 4 | low).collect())
}

fn not_hex(text: &[char], at: usize) -> Bad {
    let character = text.get(at).map_or(String::new(), |character| character.escape_debug().to_string());
    Bad::new("not_hex", format!("'{character}' is not a hexadecimal digit"))
        .with("character", character.as_str())
        .with("position", at + 1)
}

/// `digits` are at `at`.
fn odd(digits: &[char], at: usize) -> Bad {
    let digits: String = digits.iter().collect();
    Bad::new("odd_digits", format!("'{digits}' is not a whole number of bytes"))
        .with("digits", digits.as_str())
        .with("position", at + 1)
}

fn ambiguous(what: &str, at: usize) -> Bad {
    Bad::new("ambiguous", what).with("position", at + 1)
}

/// The bracket or quote at `at` is open at the end of the text.
fn unclosed(text: &[char], at: usize) -> Bad {
    let character = text[at].to_string();
    Bad::new("unclosed", format!("'{character}' is never closed"))
        .with("character", character.as_str())
        .with("position", at + 1)
}

#[cfg(test)]
mod tests;
