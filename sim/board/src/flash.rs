//! The sectors of flash that firmware writes to: their contents from one run to the next, and after a power cut.
//!
//! Sectors 1 to 3, 16 KiB each (RM0090 table 5). In a word whose programming is cut off, any of the bits are cleared that were
//! to be cleared; a sector whose erase is cut off contains anything.

use rsemu::core::space::{AddressSpace, MemAttrs};
use rsemu::core::value::Width;

/// Address of sector 1.
pub const ADDRESS: u32 = 0x0800_4000;
/// Bytes of a sector.
const SECTOR: usize = 16 * 1024;
/// Bytes of sectors 1 to 3.
pub const LENGTH: usize = 3 * SECTOR;
/// Bytes of a word.
const WORD: usize = 4;
/// An erased word.
const ERASED: u32 = u32::MAX;

/// What the sectors contain, as words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Sectors(Vec<u32>);

impl Sectors {
    /// What is in flash, without side effects.
    pub fn read(space: &AddressSpace) -> Sectors {
        let word = |address: usize| {
            let word = space.read(address as u64, Width::U32, MemAttrs::DEBUG);
            // The sectors are always there: the board text says so.
            word.map_or(ERASED, |word| word as u32)
        };
        Sectors((ADDRESS as usize..).step_by(WORD).take(LENGTH / WORD).map(word).collect())
    }

    /// Puts it into flash, past the controller.
    pub fn write(&self, space: &AddressSpace) {
        for (word, address) in self.0.iter().zip((u64::from(ADDRESS)..).step_by(WORD)) {
            let _ = space.write(address, Width::U32, u64::from(*word), MemAttrs::DEBUG);
        }
    }

    /// As bytes.
    pub fn bytes(&self) -> Vec<u8> {
        self.0.iter().flat_map(|word| word.to_le_bytes()).collect()
    }
}

/// What a step leaves that would lead from `before` to `after`.
pub(crate) fn torn(before: &Sectors, after: &Sectors, seed: u64) -> Sectors {
    let mut random = Random(seed);
    let kind = random.next() % 5;
    let mut torn = before.clone();
    let erased = before.0.iter().zip(&after.0).position(|(before, after)| after & !before != 0);
    let sector = erased.map(|word| word * WORD / SECTOR);
    for (index, (word, after)) in torn.0.iter_mut().zip(&after.0).enumerate() {
        let noise = random.next() as u32;
        if sector == Some(index * WORD / SECTOR) {
            *word = match kind {
                0 => noise,
                1 => *word | noise,
                2 => 0,
                3 if index.is_multiple_of(2) => ERASED,
                4 => ERASED,
                _ => *word,
            };
        } else {
            // Between all and none of the bits that were to be cleared.
            *word &= after | [noise, 0, ERASED, !(1 << (noise % 32)), noise][kind as usize];
        }
    }
    torn
}

/// SplitMix64 (Steele, Lea, Flood 2014): the same every time.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sectors(words: &[(usize, u32)]) -> Sectors {
        let mut all = vec![ERASED; LENGTH / WORD];
        words.iter().for_each(|(index, word)| all[*index] = *word);
        Sectors(all)
    }

    #[test]
    fn a_torn_word_is_between_before_and_after() {
        let (before, after) = (sectors(&[]), sectors(&[(7, 0x1234_5678)]));
        let mut seen = std::collections::BTreeSet::new();
        for seed in 0..100 {
            let torn = torn(&before, &after, seed);
            assert_eq!(torn.0[7] & 0x1234_5678, 0x1234_5678);
            seen.insert(torn.0[7]);
            let others = torn.0.iter().enumerate().filter(|(index, _)| *index != 7);
            assert!(others.clone().all(|(_, word)| *word == ERASED));
        }
        assert!(seen.len() > 10, "{seen:x?}");
    }

    #[test]
    fn a_torn_erase_spares_the_other_sectors() {
        let second = SECTOR / WORD;
        let before = sectors(&[(0, 1), (second, 2), (second + 9, 3), (2 * second, 4)]);
        let after = sectors(&[(0, 1), (2 * second, 4)]);
        for seed in 0..100 {
            let torn = torn(&before, &after, seed);
            assert_eq!(torn.0[..second], before.0[..second]);
            assert_eq!(torn.0[2 * second..], before.0[2 * second..]);
        }
    }
}
