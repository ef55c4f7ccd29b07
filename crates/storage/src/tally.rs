//! How often power came, in flash: a number that no power cycle repeats.
//!
//! ```text
//! word 0        word 1        word 2
//! 00000000      00000000      FFFFFFE0      FFFFFFFF …        2 · 32 + 5 = 69
//! ```
//!
//! A count clears one more bit, the lowest first: no erase, no wear, one word programmed at each power-up. A part may turn ones
//! into zeros at any time (RM0090 section 3.6.4). A cut while a bit is cleared leaves it cleared or not; a word that holds
//! anything else counts as full, so that the number only ever grows.
//!
//! Limit: a sector of 128 KiB holds 1 048 576 counts, ten years of a power-up every five minutes. A full one stays at its end.

use embedded_storage::nor_flash::NorFlash;

/// Bytes of a word.
const WORD: usize = 4;

/// A tally in this flash, from its offset 0 to its capacity.
pub struct Tally<F>(F);

/// Where the tally stands.
struct Place {
    /// The first word that is not used up.
    word: u32,
    /// What it holds; zero where all are used up.
    bits: u32,
}

impl<F: NorFlash> Tally<F> {
    /// Nothing is read yet.
    pub const fn new(flash: F) -> Tally<F> {
        Tally(flash)
    }

    /// The flash.
    pub fn into_flash(self) -> F {
        self.0
    }

    /// How often it was counted.
    ///
    /// # Errors
    /// The flash cannot be read.
    pub fn count(&mut self) -> Result<u32, F::Error> {
        Ok(self.place()?.count())
    }

    /// Counts once more; returns how often it was counted, this time included. A full tally stays as it is.
    ///
    /// # Errors
    /// The flash cannot be read or written.
    pub fn add(&mut self) -> Result<u32, F::Error> {
        let place = self.place()?;
        if place.bits != 0 {
            let bits = place.bits.wrapping_shl(1);
            self.0.write(place.word.wrapping_mul(WORD as u32), &bits.to_le_bytes())?;
        }
        self.count()
    }

    /// The words before it are used up, those behind it are not begun.
    fn place(&mut self) -> Result<Place, F::Error> {
        let words = (self.0.capacity() / WORD) as u32;
        let (mut used, mut free) = (0, words);
        while used < free {
            let middle = used.wrapping_add(free.wrapping_sub(used) / 2);
            match self.word(middle)? {
                u32::MAX => free = middle,
                _ => used = middle.wrapping_add(1),
            }
        }
        // The last word that was begun has bits left, or the first that was not is next.
        if let Some(last) = used.checked_sub(1) {
            let bits = self.word(last)?;
            if bits != 0 && is_count(bits) {
                return Ok(Place { word: last, bits });
            }
        }
        Ok(Place { word: used, bits: if used < words { u32::MAX } else { 0 } })
    }

    fn word(&mut self, word: u32) -> Result<u32, F::Error> {
        let mut bytes = [0; WORD];
        self.0.read(word.wrapping_mul(WORD as u32), &mut bytes)?;
        Ok(u32::from_le_bytes(bytes))
    }
}

/// Whether a word was made by counting: zeros below, ones above.
const fn is_count(bits: u32) -> bool {
    bits == u32::MAX.wrapping_shl(bits.trailing_zeros())
}

impl Place {
    fn count(&self) -> u32 {
        let in_word = if self.bits == 0 { 0 } else { self.bits.trailing_zeros() };
        self.word.wrapping_mul(u32::BITS).wrapping_add(in_word)
    }
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;
    use std::vec::Vec;

    use embedded_storage::nor_flash::{ErrorType, ReadNorFlash};
    use proptest::prelude::*;

    use super::*;

    /// Flash that only loses bits.
    #[derive(Clone)]
    struct Words(Vec<u32>);

    impl ErrorType for Words {
        type Error = Infallible;
    }

    impl ReadNorFlash for Words {
        const READ_SIZE: usize = 1;

        fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Infallible> {
            bytes.copy_from_slice(&self.0[offset as usize / WORD].to_le_bytes());
            Ok(())
        }

        fn capacity(&self) -> usize {
            self.0.len() * WORD
        }
    }

    impl NorFlash for Words {
        const WRITE_SIZE: usize = WORD;
        const ERASE_SIZE: usize = 128 * 1024;

        fn erase(&mut self, _: u32, _: u32) -> Result<(), Infallible> {
            panic!("a tally erases nothing")
        }

        fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Infallible> {
            let word = &mut self.0[offset as usize / WORD];
            let new = u32::from_le_bytes(bytes.try_into().unwrap());
            assert_eq!(new & !*word, 0, "no bit can be set again");
            *word &= new;
            Ok(())
        }
    }

    fn blank(words: usize) -> Words {
        Words(std::vec![u32::MAX; words])
    }

    #[test]
    fn every_count_is_the_next_until_it_is_full() {
        let mut flash = blank(5);
        for expected in 1..=160 {
            let mut tally = Tally::new(flash);
            assert_eq!(tally.add(), Ok(expected));
            flash = tally.into_flash();
            assert_eq!(Tally::new(flash.clone()).count(), Ok(expected));
        }
        let mut full = Tally::new(flash);
        assert_eq!([full.add(), full.add(), full.count()], [Ok(160); 3]);
    }

    #[test]
    fn a_blank_sector_of_the_part_counts_from_one() {
        let mut tally = Tally::new(blank(32 * 1024));
        assert_eq!((tally.count(), tally.add()), (Ok(0), Ok(1)));
    }

    proptest! {
        /// The number grows with each count whatever a cut has left in the word in hand, and never falls.
        #[test]
        fn a_cut_never_makes_it_smaller(cuts in prop::collection::vec((0_u32..40, any::<u32>()), 1..12)) {
            let mut flash = blank(64);
            let mut last = 0;
            for (counts, lost) in cuts {
                for _ in 0..counts {
                    let mut tally = Tally::new(flash);
                    let count = tally.add().unwrap();
                    prop_assert!(count > last, "{} after {}", count, last);
                    last = count;
                    flash = tally.into_flash();
                }
                // Some bits of the word in hand are lost.
                let place = Tally::new(flash.clone()).place().unwrap();
                if let Some(word) = flash.0.get_mut(place.word as usize) {
                    *word &= lost;
                }
                let count = Tally::new(flash.clone()).count().unwrap();
                prop_assert!(count >= last, "{} after {}", count, last);
                last = count;
            }
        }
    }
}
