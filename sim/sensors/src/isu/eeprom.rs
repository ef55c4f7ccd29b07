//! The ISU's EEPROM: 256 words of 16 bits.
//!
//! A word of user data is spread over the two low bits of eight consecutive EEPROM words, low byte first,
//! most significant pair first; the upper 14 bits are the module's own:
//!
//! ```text
//! word       start  +1    +2    +3    +4     +5     +6     +7
//! data bits  7,6    5,4   3,2   1,0   15,14  13,12  11,10  9,8
//! ```
//! The data word at 78H is the checksum: the low 16 bits of the sum of all words, except the bits that hold
//! the checksum itself.
//!
//! Source: "Interfacing to an ISU Module", section 6 and the examples of section 7. Table 4 is lost in the
//! scan; the order follows from what is left of the list under "Setting the Module Address".
//!
//! A word is either written or not when the power fails; a word torn in the middle is not modelled, because
//! its upper 14 bits could not be restored by any means the document gives.

use oorandom::Rand64;

/// Words in the EEPROM.
pub const WORDS: usize = 256;

/// First words of the documented locations (table 5).
pub mod location {
    /// Null position, in 360/65536 °.
    pub const NULL_POSITION: u8 = 0xD0;
    /// Module address word.
    pub const MODULE_ADDRESS: u8 = 0x48;
    /// Auto-shutoff word.
    pub const AUTO_SHUTOFF: u8 = 0x50;
    /// Checksum.
    pub const CHECKSUM: u8 = 0x78;
}

/// EEPROM words that hold one data word.
const SPREAD: u8 = 8;

/// The bits of an EEPROM word that hold user data.
const USER_BITS: u16 = 0b11;

/// Right shift that brings each word's pair of data bits to the bottom.
const SHIFTS: [u8; SPREAD as usize] = [6, 4, 2, 0, 14, 12, 10, 8];

/// Position of the address in the module address word: bits 7 to 4.
const ADDRESS_SHIFT: u8 = 4;

/// What "the sum of all 256 words" means for the words that hold the checksum. Their two low bits cannot
/// be in it, or the document's rule for updating the checksum would not hold; it says nothing of the
/// others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ChecksumScope {
    /// The upper 14 bits of the checksum words count.
    #[default]
    UpperBitsCounted,
    /// The checksum words do not count at all.
    WordsLeftOut,
}

/// What the factory stores in the documented locations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Content {
    /// Module address 0 to 15; 0 is the factory default, 15 is reserved.
    pub address: u8,
    /// Null position in 360/65536 °.
    pub null: u16,
    /// Bit 0 of the auto-shutoff word, the likeliest of the three that its unreadable subscript allows.
    pub auto_shutoff: bool,
}

/// The EEPROM.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Eeprom {
    words: [u16; WORDS],
    scope: ChecksumScope,
}

impl Eeprom {
    /// A sound EEPROM. Everything that the document does not describe is filled from `seed`.
    #[must_use]
    pub fn factory(content: Content, scope: ChecksumScope, seed: u64) -> Self {
        let mut random = Rand64::new(u128::from(seed));
        let mut eeprom = Self { words: [(); WORDS].map(|()| random.rand_u64() as u16), scope };
        let others = eeprom.data(location::MODULE_ADDRESS) & !(0xF << ADDRESS_SHIFT);
        eeprom.set_data(location::MODULE_ADDRESS, others | u16::from(content.address & 0xF) << ADDRESS_SHIFT);
        eeprom.set_data(location::NULL_POSITION, content.null);
        let others = eeprom.data(location::AUTO_SHUTOFF) & !1;
        eeprom.set_data(location::AUTO_SHUTOFF, others | u16::from(content.auto_shutoff));
        eeprom.set_data(location::CHECKSUM, eeprom.computed_checksum());
        eeprom
    }

    /// One word.
    #[must_use]
    pub fn word(&self, address: u8) -> u16 {
        self.words[usize::from(address)]
    }

    /// All words.
    #[must_use]
    pub fn words(&self) -> &[u16; WORDS] {
        &self.words
    }

    /// Stores one word, whatever it does to the checksum.
    pub fn set_word(&mut self, address: u8, word: u16) {
        self.words[usize::from(address)] = word;
    }

    /// The data word that begins at `start`.
    #[must_use]
    pub fn data(&self, start: u8) -> u16 {
        spread(start).fold(0, |data, (address, shift)| data | (self.word(address) & USER_BITS) << shift)
    }

    /// The eight EEPROM words, with their addresses, that make `data` the data word at `start`.
    #[must_use]
    pub fn encoded(&self, start: u8, data: u16) -> Vec<(u8, u16)> {
        spread(start)
            .map(|(address, shift)| (address, self.word(address) & !USER_BITS | data >> shift & USER_BITS))
            .collect()
    }

    fn set_data(&mut self, start: u8, data: u16) {
        for (address, word) in self.encoded(start, data) {
            self.set_word(address, word);
        }
    }

    /// The module address that the EEPROM holds.
    #[must_use]
    pub fn address(&self) -> u8 {
        (self.data(location::MODULE_ADDRESS) >> ADDRESS_SHIFT & 0xF) as u8
    }

    /// The null position that the EEPROM holds, in 360/65536 °.
    #[must_use]
    pub fn null(&self) -> u16 {
        self.data(location::NULL_POSITION)
    }

    /// The checksum that the words call for.
    #[must_use]
    pub fn computed_checksum(&self) -> u16 {
        (0..=u8::MAX).zip(self.words).fold(0, |sum: u16, (address, word)| {
            let holds_checksum = spread(location::CHECKSUM).any(|(own, _)| own == address);
            sum.wrapping_add(match (holds_checksum, self.scope) {
                (false, _) => word,
                (true, ChecksumScope::UpperBitsCounted) => word & !USER_BITS,
                (true, ChecksumScope::WordsLeftOut) => 0,
            })
        })
    }

    /// The stored checksum is the right one.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        self.data(location::CHECKSUM) == self.computed_checksum()
    }
}

/// Addresses of the words that hold a data word, and the shift of the two bits in each.
fn spread(start: u8) -> impl Iterator<Item = (u8, u8)> {
    (0..SPREAD).map(move |i| start.wrapping_add(i)).zip(SHIFTS)
}
