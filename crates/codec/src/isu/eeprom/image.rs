//! A complete copy of the EEPROM and what it says. Source: AN #201 §6.

use super::packing::{WORDS_PER_DATA_WORD, unpack, without_user_bits};
use crate::angle::Angle;
use crate::isu::Address;

/// Words in the EEPROM.
const SIZE: usize = 256;

/// The data words that the document names, by the EEPROM address at which they start. Source: table 5.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(u8)]
pub enum DataWord {
    /// 48.
    ModuleAddress = 0x48,
    /// 50.
    AutoShutoff = 0x50,
    /// 78.
    Checksum = 0x78,
    /// D0.
    NullPosition = 0xD0,
}

impl DataWord {
    /// Address of the first of its eight EEPROM words.
    pub const fn start(self) -> u8 {
        self as u8
    }
}

/// All 256 words of a module's EEPROM.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image([u16; SIZE]);

impl Image {
    /// An image of these words.
    pub const fn new(words: [u16; SIZE]) -> Self {
        Self(words)
    }

    /// All words.
    pub const fn words(&self) -> &[u16; SIZE] {
        &self.0
    }

    /// One word.
    pub fn word(&self, address: u8) -> u16 {
        self.0.get(usize::from(address)).copied().unwrap_or(0)
    }

    /// Takes over words that were read from `start` on; what lies beyond FF is left out.
    ///
    /// ```
    /// use clino_codec::isu::eeprom::Image;
    ///
    /// let mut image = Image::new([0; 256]);
    /// image.fill(0x10, [1, 2, 3]);
    /// assert_eq!(image.word(0x12), 3);
    /// ```
    pub fn fill(&mut self, start: u8, words: impl IntoIterator<Item = u16>) {
        for (slot, word) in self.0.iter_mut().skip(usize::from(start)).zip(words) {
            *slot = word;
        }
    }

    /// The eight EEPROM words of a data word.
    pub fn group(&self, data_word: DataWord) -> [u16; WORDS_PER_DATA_WORD] {
        let words = self.0.get(usize::from(data_word.start())..).and_then(|words| words.first_chunk());
        // All data words lie within the image.
        words.copied().unwrap_or([0; WORDS_PER_DATA_WORD])
    }

    /// A data word.
    #[inline(never)]
    pub fn data(&self, data_word: DataWord) -> u16 {
        unpack(self.group(data_word))
    }

    /// The module's address: bits 7…4 of the data word. May be the reserved one in a damaged image.
    pub fn module_address(&self) -> Address {
        Address::of_head(self.data(DataWord::ModuleAddress) as u8)
    }

    /// The null position, to which angles refer.
    pub fn null_position(&self) -> Angle {
        Angle::from_turn16(self.data(DataWord::NullPosition))
    }

    /// Computes the checksum in both ways that the document allows.
    pub fn audit(&self) -> Audit {
        let checksum_words = self.group(DataWord::Checksum);
        let words_left_out = total(&self.0).wrapping_sub(total(&checksum_words));
        let upper_bits = total(&checksum_words.map(without_user_bits));
        Audit {
            stored: unpack(checksum_words),
            upper_bits_counted: words_left_out.wrapping_add(upper_bits),
            words_left_out,
        }
    }
}

/// The sum of these words, as far as it fits 16 bits.
#[inline(never)]
pub(super) fn total(words: &[u16]) -> u16 {
    words.iter().fold(0, |total, &word| total.wrapping_add(word))
}

/// What the checksum covers.
///
/// The document says "all 256 EEPROM words", and gives a rule for changes that can hold only if the
/// checksum's own 16 bits are not among them. Whether the upper 14 bits of the words that hold it are, it
/// does not say.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum ChecksumReading {
    /// All words, but not the two low bits of the eight that hold the checksum.
    UpperBitsCounted,
    /// The 248 words that do not hold the checksum.
    WordsLeftOut,
}

/// The stored checksum, and what it should be in either reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Audit {
    /// As found in the image.
    pub stored: u16,
    /// Computed as [`ChecksumReading::UpperBitsCounted`].
    pub upper_bits_counted: u16,
    /// Computed as [`ChecksumReading::WordsLeftOut`].
    pub words_left_out: u16,
}

impl Audit {
    /// The checksum in that reading.
    pub const fn computed(&self, reading: ChecksumReading) -> u16 {
        match reading {
            ChecksumReading::UpperBitsCounted => self.upper_bits_counted,
            ChecksumReading::WordsLeftOut => self.words_left_out,
        }
    }

    /// Whether the stored checksum is right in that reading.
    pub const fn holds(&self, reading: ChecksumReading) -> bool {
        self.stored == self.computed(reading)
    }

    /// Whether the stored checksum is right in at least one reading.
    pub const fn is_sound(&self) -> bool {
        self.holds(ChecksumReading::UpperBitsCounted) || self.holds(ChecksumReading::WordsLeftOut)
    }

    /// The one reading in which the stored checksum is right; `None` when neither fits, or both do.
    pub const fn only_reading(&self) -> Option<ChecksumReading> {
        match (self.holds(ChecksumReading::UpperBitsCounted), self.holds(ChecksumReading::WordsLeftOut)) {
            (true, false) => Some(ChecksumReading::UpperBitsCounted),
            (false, true) => Some(ChecksumReading::WordsLeftOut),
            _ => None,
        }
    }
}
