//! Memory contents as arguments.

use clino_codec::isu::{Data, MAX_DATA, MAX_WORDS, Words};

use crate::bad::Bad;
use crate::hex;

/// Bytes of RAM.
///
/// # Errors
/// What is wrong with the text, in the words of the arguments.
pub fn data(groups: &[String]) -> Result<Data, String> {
    let text = groups.join(" ");
    let invalid = |reason: &str| format!("invalid value '{text}' for '--data <HEX>': {reason}");
    let bytes = hex::parse(text.as_bytes()).map_err(|bad: Bad| invalid(bad.message()))?;
    Data::new(&bytes).ok_or_else(|| invalid(&format!("{} bytes are not in 1..={MAX_DATA}", bytes.len())))
}

/// Words of EEPROM.
///
/// # Errors
/// What is wrong with the text, in the words of the arguments.
pub fn words(groups: &[String]) -> Result<Words, String> {
    let text = groups.join(" ");
    let invalid = |reason: String| format!("invalid value '{text}' for '--words <HEX>': {reason}");
    let words = text
        .bytes()
        .collect::<Vec<u8>>()
        .split(|&character| hex::is_separator(character))
        .filter(|group| !group.is_empty())
        .map(|group| word(group).ok_or_else(|| invalid(not_a_word(group))))
        .collect::<Result<Vec<u16>, String>>()?;
    match Words::new(&words) {
        Some(counted) if !counted.is_empty() => Ok(counted),
        _ => Err(invalid(format!("{} words are not in 1..={MAX_WORDS}", words.len()))),
    }
}

fn word(group: &[u8]) -> Option<u16> {
    let digits = hex::without_prefix(group).unwrap_or(group);
    if !digits.iter().all(u8::is_ascii_hexdigit) {
        return None;
    }
    u16::from_str_radix(str::from_utf8(digits).ok()?, 16).ok()
}

fn not_a_word(group: &[u8]) -> String {
    format!("'{}' is not a hexadecimal number in 0..=FFFF", group.escape_ascii())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(groups: &[&str]) -> Result<Vec<u16>, String> {
        let groups: Vec<String> = groups.iter().map(|&group| group.to_owned()).collect();
        words(&groups).map(|words| words.iter().collect())
    }

    #[test]
    fn words_one_by_one_in_any_customary_form() {
        assert_eq!(parsed(&["1234", "abcd"]).unwrap(), [0x1234, 0xABCD]);
        assert_eq!(parsed(&["0x12, 3 0XFFFF"]).unwrap(), [0x0012, 0x0003, 0xFFFF]);
    }

    #[test]
    fn what_is_no_list_of_words_is_refused_with_the_limit() {
        assert!(parsed(&["12345"]).unwrap_err().contains("'12345' is not a hexadecimal number in 0..=FFFF"));
        assert!(parsed(&["12", "+5"]).unwrap_err().contains("'+5'"));
        assert!(parsed(&["0x"]).unwrap_err().contains("'0x'"));
        assert!(parsed(&[" "]).unwrap_err().contains("0 words are not in 1..=126"));
        assert!(parsed(&["0 "; 127]).unwrap_err().contains("127 words are not in 1..=126"));
        assert_eq!(parsed(&["0"; 126]).unwrap().len(), 126);
    }
}
