//! Bytes as hexadecimal text, tolerant on the way in: any case, with or without blanks, commas, `0x`.
//!
//! Groups of digits are separated by blanks or commas; each holds whole bytes and may begin with `0x`. A lone digit
//! is refused: it is as likely half a byte lost as a byte below 10.

use std::fmt::Write as _;

use crate::bad::Bad;

/// The bytes that the text shows, which are at least one.
///
/// # Errors
/// What is no hexadecimal text, and at which character (the first is 1).
pub fn parse(text: &[u8]) -> Result<Vec<u8>, Bad> {
    let mut bytes = Vec::new();
    let mut position = 1;
    for group in text.split(|&character| is_separator(character)) {
        parse_group(group, position, &mut bytes)?;
        position += group.len() + 1;
    }
    if bytes.is_empty() {
        return Err(Bad::new("empty", "no bytes"));
    }
    Ok(bytes)
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

fn parse_group(group: &[u8], position: usize, bytes: &mut Vec<u8>) -> Result<(), Bad> {
    let (digits, position) = match without_prefix(group) {
        Some([]) => return Err(odd(group, position)),
        Some(digits) => (digits, position + 2),
        None => (group, position),
    };
    if let Some(offset) = digits.iter().position(|character| !character.is_ascii_hexdigit()) {
        let character = digits[offset].escape_ascii().to_string();
        let message = format!("'{character}' is not a hexadecimal digit");
        return Err(Bad::new("not_hex", message)
            .with("character", character.as_str())
            .with("position", position + offset));
    }
    let (pairs, rest) = digits.as_chunks();
    if !rest.is_empty() {
        return Err(odd(group, position));
    }
    bytes.extend(pairs.iter().map(|&[high, low]| nibble(high) << 4 | nibble(low)));
    Ok(())
}

fn odd(group: &[u8], position: usize) -> Bad {
    let group = group.escape_ascii().to_string();
    Bad::new("odd_digits", format!("'{group}' is not a whole number of bytes"))
        .with("digits", group.as_str())
        .with("position", position)
}

/// The value of a hexadecimal digit.
fn nibble(digit: u8) -> u8 {
    match digit {
        b'0'..=b'9' => digit - b'0',
        _ => (digit | 0x20) - b'a' + 10,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_customary_way_to_write_bytes() {
        for text in [
            "05 01 8a",
            "05018A",
            "0501 8A",
            " 05\t01  8a \r",
            "0x05 0x01 0x8A",
            "0X05,0x01, 0x8a,",
            "0x05018A",
        ] {
            assert_eq!(parse(text.as_bytes()).unwrap(), [0x05, 0x01, 0x8A], "{text}");
        }
        let all: Vec<u8> = (0..=255).collect();
        assert_eq!(parse(show(&all).as_bytes()).unwrap(), all);
        assert_eq!(parse(show(&all).to_lowercase().as_bytes()).unwrap(), all);
    }

    #[test]
    fn what_is_not_bytes_is_refused_with_its_place() {
        for (text, kind, position) in [
            ("05 1 80", "odd_digits", Some("4")),
            ("05 0x", "odd_digits", Some("4")),
            ("05 0x1", "odd_digits", Some("6")),
            ("05 0G", "not_hex", Some("5")),
            ("0x0x05", "not_hex", Some("4")),
            ("05;01", "not_hex", Some("3")),
            ("\u{b0}5", "not_hex", Some("1")),
            ("", "empty", None),
            (" , ", "empty", None),
        ] {
            let error = serde_json::to_value(parse(text.as_bytes()).unwrap_err()).unwrap();
            assert_eq!(error["error"]["kind"], kind, "{text}");
            let found = error["error"].get("position").map(ToString::to_string);
            assert_eq!(found.as_deref(), position, "{text}");
        }
    }
}
