//! Receiver errors as a Unix terminal marks them (`PARMRK`): what the UART said of a character, in the stream of bytes.
//!
//! ```text
//! FF FF       the byte FF, received well
//! FF 00 00    a break: the line was low for a character at least
//! FF 00 xx    the byte xx, with a low stop bit or wrong parity
//! xx          the byte xx, received well
//! ```
//! Source: POSIX.1-2017, section 11.2.2, Input Modes.

use clino_codec::character::{Character, LineErrors};

const MARK: u8 = 0xFF;

/// Takes bytes, gives characters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Marks {
    #[default]
    None,
    /// The mark has come.
    Mark,
    /// The mark and a zero have come.
    Error,
}

impl Marks {
    /// The next byte; the character it completes.
    pub fn take(&mut self, byte: u8) -> Option<Character> {
        let (next, character) = match (*self, byte) {
            (Self::None, MARK) => (Self::Mark, None),
            (Self::Mark, 0) => (Self::Error, None),
            // Parity is not checked, so that it is the stop bit.
            (Self::Error, byte) => (Self::None, Some(Character { byte, errors: LineErrors::FRAMING })),
            // A mark followed by something else is no mark of a terminal: the byte as it is.
            (Self::None | Self::Mark, byte) => {
                (Self::None, Some(Character { byte, errors: LineErrors::NONE }))
            }
        };
        *self = next;
        character
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_told_from_bytes() {
        let mut marks = Marks::default();
        let heard: Vec<_> = [0x05, 0xFF, 0xFF, 0xFF, 0x00, 0x00, 0xFF, 0x00, 0xA5, 0xFF, 0xFF, 0x00]
            .into_iter()
            .filter_map(|byte| marks.take(byte))
            .map(|character| (character.byte, !character.errors.is_none()))
            .collect();
        let expected =
            [(0x05, false), (0xFF, false), (0x00, true), (0xA5, true), (0xFF, false), (0x00, false)];
        assert_eq!(heard, expected);
    }
}
