//! The name that a user gives a slot: up to 16 printable ASCII characters, without quotation marks, which enclose it
//! where it is typed.

/// A name. It may be empty.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Name([u8; Name::LENGTH]);

impl Name {
    /// Characters of the longest name.
    pub const LENGTH: usize = 16;

    /// Characters of a part. A name is transferred in parts of one number each: its characters, the first in the
    /// highest byte; zeros behind its end.
    pub const PART: usize = 4;

    /// No name.
    pub const NONE: Name = Name([0; Name::LENGTH]);

    /// This name; `None` if it is too long, or has other characters.
    pub fn new(text: &str) -> Option<Name> {
        let mut name = Name::NONE;
        let place = name.0.get_mut(..text.len())?;
        place.iter_mut().zip(text.bytes()).for_each(|(place, byte)| *place = byte);
        name.is_valid().then_some(name)
    }

    /// The name as text.
    pub fn as_str(&self) -> &str {
        let length = self.0.iter().take_while(|&&byte| byte != 0).count();
        self.0.get(..length).and_then(|bytes| core::str::from_utf8(bytes).ok()).unwrap_or("")
    }

    /// Whether all characters are printable, and none stands behind the end.
    pub fn is_valid(&self) -> bool {
        let length = self.0.iter().take_while(|&&byte| is_printable(byte)).count();
        self.0.iter().skip(length).all(|&byte| byte == 0)
    }

    /// A part of the name.
    pub fn part(&self, part: usize) -> u32 {
        let (parts, _) = self.0.as_chunks::<{ Name::PART }>();
        parts.get(part).map_or(0, |&bytes| u32::from_be_bytes(bytes))
    }

    /// Puts a part in its place.
    pub fn set_part(&mut self, part: usize, characters: u32) {
        let (parts, _) = self.0.as_chunks_mut::<{ Name::PART }>();
        if let Some(place) = parts.get_mut(part) {
            *place = characters.to_be_bytes();
        }
    }
}

/// Whether these are characters of a part: printable, and none behind a zero.
pub fn are_characters(part: u32) -> bool {
    let bytes = part.to_be_bytes();
    let length = bytes.iter().take_while(|&&byte| is_printable(byte)).count();
    bytes.iter().skip(length).all(|&byte| byte == 0)
}

const fn is_printable(byte: u8) -> bool {
    (byte.is_ascii_graphic() && byte != b'"') || byte == b' '
}
