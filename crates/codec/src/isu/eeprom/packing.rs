//! Two bits in each of eight words. Source: AN #201 §6, table 4; see the module above for the order.

/// EEPROM words that hold one data word.
pub const WORDS_PER_DATA_WORD: usize = 8;

/// The part of an EEPROM word that users own.
const USER_BITS: u16 = 0b11;

/// Bit position of the lower bit of each pair, word by word.
const SHIFTS: [u32; WORDS_PER_DATA_WORD] = [6, 4, 2, 0, 14, 12, 10, 8];

/// The data word that eight EEPROM words hold.
///
/// ```
/// use clino_codec::isu::eeprom::{pack, unpack};
///
/// let words = [0xA5A4; 8];
/// let changed = pack(words, 0x0030);
/// assert_eq!(unpack(changed), 0x0030);
/// assert_eq!(changed, [0xA5A4, 0xA5A7, 0xA5A4, 0xA5A4, 0xA5A4, 0xA5A4, 0xA5A4, 0xA5A4]);
/// ```
pub fn unpack(words: [u16; WORDS_PER_DATA_WORD]) -> u16 {
    words.iter().zip(SHIFTS).fold(0, |data, (word, shift)| data | (word & USER_BITS) << shift)
}

/// The eight EEPROM words with another data word in them; their upper 14 bits stay.
#[must_use]
pub fn pack(mut words: [u16; WORDS_PER_DATA_WORD], data: u16) -> [u16; WORDS_PER_DATA_WORD] {
    for (word, shift) in words.iter_mut().zip(SHIFTS) {
        *word = without_user_bits(*word) | data >> shift & USER_BITS;
    }
    words
}

/// The manufacturer's part of an EEPROM word.
pub(super) const fn without_user_bits(word: u16) -> u16 {
    word & !USER_BITS
}
