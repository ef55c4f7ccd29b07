//! Lines of a dump: an offset before the bytes, their characters behind them.
//!
//! ```text
//! 00000000: 0506 83ff ff4e ff27  .....N.'                          xxd, tcpdump -X (0x0000:)
//! 00000000  05 06 83 ff ff 4e ff 27  |.....N.'|                    hexdump -C
//! 0000   05 06 83 ff ff 4e ff 27   .....N.'                        Wireshark
//! 0000000 05 06 83 ff ff 4e ff 27  >.....N.'<                      od -A o -t x1z
//! (1436509052.249713) can0  123   [8]  05 06 83 FF FF 4E FF 27     candump
//! can0 123#050683FFFF4EFF27                                        candump -L
//! ```
//!
//! Nothing is left out that may be a byte. An offset has a colon, or is where the bytes before it end and stands apart
//! from those behind it. The characters behind the bytes have to be those of the bytes. The count in brackets has to be
//! their number. Several lines follow each other without a gap. Words of 16 bits without a colon are refused: `hexdump`
//! and `od -x` swap their bytes on most computers.

use super::{ambiguous, bytes, is_blank};
use crate::bad::Bad;

/// Digits of the shortest offset.
const SHORTEST_OFFSET: usize = 4;

/// The bytes, if the text is a dump.
///
/// # Errors
/// It is one that can be read in two ways.
pub fn parse(text: &[char]) -> Result<Option<Vec<u8>>, Bad> {
    let mut all = Vec::new();
    let mut base = None;
    let mut start = 0;
    let lines: Vec<&[char]> = text.split(|&character| character == '\n').collect();
    for line in &lines {
        let at = start;
        start += line.len() + 1;
        if line.iter().all(|&character| is_blank(character)) {
            continue;
        }
        if let Some(bytes) = frame_of_candump(line) {
            return if all.is_empty() && is_last(&lines, line) { Ok(Some(bytes)) } else { Ok(None) };
        }
        let parsed = Line::parse(line, at, all.len(), base)?;
        let Some(parsed) = parsed else {
            return if all.is_empty() { Ok(None) } else { Err(ambiguous("a line of the dump is none", at)) };
        };
        base = base.or(parsed.offset);
        all.extend(parsed.bytes);
    }
    Ok((!all.is_empty()).then_some(all))
}

fn is_last(lines: &[&[char]], line: &[char]) -> bool {
    let others = lines.iter().filter(|other| !std::ptr::eq(**other, line));
    others.copied().flatten().all(|&character| is_blank(character))
}

/// A line of a dump.
struct Line {
    offset: Option<usize>,
    bytes: Vec<u8>,
}

impl Line {
    /// The line at `at` of a dump that begins at offset `base`, `before` bytes of which are there.
    fn parse(line: &[char], at: usize, before: usize, base: Option<usize>) -> Result<Option<Line>, Bad> {
        let lead = line.iter().take_while(|&&character| is_blank(character)).count();
        let text = &line[lead..];
        let prefix = if matches!(text, ['0', 'x' | 'X', ..]) { 2 } else { 0 };
        let count = text[prefix..].iter().take_while(|digit| digit.is_ascii_hexdigit()).count();
        let digits = &text[prefix..prefix + count];
        let colon = usize::from(text.get(prefix + count) == Some(&':'));
        let behind = &text[prefix + count + colon..];
        let gap = behind.iter().take_while(|&&character| is_blank(character)).count();
        let body = &behind[gap..];
        let offset =
            (count >= SHORTEST_OFFSET && (gap > 0 || body.is_empty())).then(|| number(digits, 16)).flatten();
        let Some(offset) = offset else { return Ok(Line::without_offset(text)) };
        let expected = base.unwrap_or(0) + before;
        let octal = number(digits, 8);
        let fits = if base.is_some() { offset == expected } else { colon == 1 || offset == 0 };
        let fits = fits || before > 0 && octal == Some(expected);
        if body.is_empty() {
            // `od` and `hexdump` end with the offset of the end.
            return Ok((before > 0 && fits).then(|| Line { offset: None, bytes: Vec::new() }));
        }
        let body_at = at + lead + prefix + count + colon + gap;
        let (bytes, columns) = match body_of(body) {
            Some(found) => found,
            None if colon == 1 => {
                return Err(ambiguous("behind the offset are other things than bytes", body_at));
            }
            None => return Ok(None),
        };
        if colon == 1 {
            return if fits {
                Ok(Some(Line { offset: Some(offset), bytes }))
            } else {
                Err(gap_in(at + lead))
            };
        }
        let groups: Vec<usize> = groups(columns.hex).map(<[char]>::len).collect();
        let pairs = groups.iter().all(|&length| length == 2);
        let apart = gap > 1 || count % 2 == 1 || columns.text;
        match (fits, pairs, apart) {
            (true, true, true) => Ok(Some(Line { offset: Some(offset), bytes })),
            (true, true, false) => Err(ambiguous("an offset, or bytes", at + lead)),
            (true, false, _) if count % 2 == 1 => {
                Err(ambiguous("words, whose bytes may be swapped", body_at))
            }
            (false, ..) if before > 0 => Err(gap_in(at + lead)),
            (false, true, _) if columns.text => Ok(Some(Line { offset: Some(offset), bytes })),
            _ => Ok(None),
        }
    }

    /// Bytes and their characters, and nothing else.
    fn without_offset(text: &[char]) -> Option<Line> {
        let (bytes, columns) = body_of(text)?;
        // Characters that are digits, too, may be bytes.
        let is_text = columns.text && super::scan::parse(text).is_err();
        is_text.then_some(Line { offset: None, bytes })
    }
}

/// What is in a line behind its offset.
struct Columns<'a> {
    hex: &'a [char],
    /// The characters of the bytes are there.
    text: bool,
}

/// The bytes, with their characters behind them or without.
fn body_of(body: &[char]) -> Option<(Vec<u8>, Columns<'_>)> {
    let wide = |at: &usize| body[*at..].iter().take(2).filter(|&&character| is_blank(character)).count() == 2;
    for end in (0..body.len()).filter(wide) {
        let Some(bytes) = pure(&body[..end]) else { continue };
        let text: String = body[end..].iter().collect();
        if shows(text.trim(), &bytes) || shows(text.strip_prefix("  ").unwrap_or_default().trim_end(), &bytes)
        {
            return Some((bytes, Columns { hex: &body[..end], text: true }));
        }
    }
    Some((pure(body)?, Columns { hex: body, text: false }))
}

/// The bytes of groups that are apart by blanks.
fn pure(text: &[char]) -> Option<Vec<u8>> {
    let all: Option<Vec<Vec<u8>>> = groups(text).map(bytes).collect();
    all.map(|all| all.concat()).filter(|bytes| !bytes.is_empty())
}

fn groups(text: &[char]) -> impl Iterator<Item = &[char]> {
    text.split(|&character| is_blank(character)).filter(|group| !group.is_empty())
}

/// Whether a text shows these bytes as characters; what cannot be shown is any character.
fn shows(text: &str, bytes: &[u8]) -> bool {
    let inside =
        [('|', '|'), ('>', '<'), ('\'', '\''), ('"', '"'), ('[', ']')].iter().find_map(|&(open, close)| {
            text.strip_prefix(open)?
                .strip_suffix(close)
                .filter(|inside| inside.chars().count() == bytes.len())
        });
    let text: Vec<char> = inside.unwrap_or(text).chars().collect();
    // Blanks at the end of a line are lost at times.
    let shown = |(index, &byte): (usize, &u8)| match text.get(index) {
        Some(&character) => {
            character == char::from(byte) || !matches!(byte, b' '..=b'~') && !is_digit(character)
        }
        None => byte == b' ',
    };
    !text.is_empty() && text.len() <= bytes.len() && bytes.iter().enumerate().all(shown)
}

fn is_digit(character: char) -> bool {
    character.is_ascii_hexdigit()
}

/// The data of one frame as `candump` prints it.
fn frame_of_candump(line: &[char]) -> Option<Vec<u8>> {
    let line: String = line.iter().collect();
    let mut words = line.split_whitespace().peekable();
    words.next_if(|word| word.starts_with('(') && word.ends_with(')'));
    let interface = words.next().filter(|word| word.contains("can"))?;
    let id = words.next()?;
    if let Some((_, data)) = id.split_once('#') {
        return words.next().is_none().then(|| pure(&data.chars().collect::<Vec<char>>())).flatten();
    }
    let count: usize = words.next()?.strip_prefix('[')?.strip_suffix(']')?.parse().ok()?;
    let data: Vec<char> = words.by_ref().take(count).flat_map(|word| word.chars().chain([' '])).collect();
    let rest = words.next();
    let bytes = pure(&data).filter(|bytes| bytes.len() == count && !interface.is_empty())?;
    // With -a, the characters of the bytes follow.
    let text = line.rsplit_once("  '").and_then(|(_, text)| text.trim_end().strip_suffix('\''));
    (rest.is_none() || text.is_some_and(|text| shows(text, &bytes))).then_some(bytes)
}

fn number(digits: &[char], radix: u32) -> Option<usize> {
    let digits: String = digits.iter().collect();
    usize::from_str_radix(&digits, radix).ok()
}

fn gap_in(at: usize) -> Bad {
    Bad::new("offset", "the offset is not where the bytes before it end").with("position", at + 1)
}
