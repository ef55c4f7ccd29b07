//! Two bits in each of eight words. Source: AN #201 §6, table 4; see the module above for the order.

/// EEPROM words that hold one data word.
pub const WORDS_PER_DATA_WORD: usize = 8;

/// The part of an EEPROM word that users own.
const USER_BITS: u16 = 0b11;

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
    // The highest pair comes first, but the low byte before the high one.
    words.iter().fold(0_u16, |data, word| data << 2 | word & USER_BITS).swap_bytes()
}

/// The eight EEPROM words with another data word in them; their upper 14 bits stay.
#[must_use]
pub fn pack(mut words: [u16; WORDS_PER_DATA_WORD], data: u16) -> [u16; WORDS_PER_DATA_WORD] {
    let mut pairs = data.swap_bytes();
    for word in &mut words {
        pairs = pairs.rotate_left(2);
        *word = without_user_bits(*word) | pairs & USER_BITS;
    }
    words
}

/// The manufacturer's part of an EEPROM word.
pub(super) const fn without_user_bits(word: u16) -> u16 {
    word & !USER_BITS
}
