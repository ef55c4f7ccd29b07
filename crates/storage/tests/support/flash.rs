//! Sectors 1 to 3 of an STM32F407, with the rules of RM0090 section 3 and a power supply that can be cut.
//!
//! | | |
//! |---|---|
//! | program | whole, aligned words; a word must be erased, or is cleared to zero (section 3.6.4: ones may become zeros at any time) |
//! | erase | whole sectors |
//! | cut while programming | any of the bits that were to be cleared are |
//! | cut while erasing | the sector contains anything |
//!
//! A rule that is broken panics: it is a mistake of the code under test. Flash that has [rotted](Flash::rot) forgives, because
//! no code can know its content before.

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};

use super::random::Random;

const SECTOR: usize = 16 * 1024;
const SECTORS: usize = 3;
const WORD: usize = 4;
const ERASED: u32 = u32::MAX;

/// The supply is gone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PowerLost;

impl NorFlashError for PowerLost {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

/// How many ways there are for an erase to be torn.
pub const TORN_ERASES: u64 = 7;

#[derive(Clone)]
pub struct Flash {
    words: Vec<u32>,
    /// Words programmed and sectors erased.
    pub steps: u64,
    /// Of each sector.
    pub erases: [u32; SECTORS],
    /// Steps that are still carried out.
    supply: Option<u64>,
    /// How the last step is torn.
    tear: Random,
    dead: bool,
    /// The step that was torn was an erase.
    pub torn_erase: bool,
    rotten: bool,
}

impl Flash {
    /// As it comes from the factory.
    pub fn new() -> Flash {
        Flash {
            words: vec![ERASED; SECTORS * SECTOR / WORD],
            steps: 0,
            erases: [0; SECTORS],
            supply: None,
            tear: Random(0),
            dead: false,
            torn_erase: false,
            rotten: false,
        }
    }

    /// Puts this content into the flash from this word on. Programming a word that is not erased clears bits from now
    /// on, as the part does.
    pub fn rot(&mut self, word: usize, content: impl IntoIterator<Item = u32>) {
        self.rotten = true;
        self.words.iter_mut().skip(word).zip(content).for_each(|(word, new)| *word = new);
    }

    /// This many more steps, and then one that is torn.
    pub fn cut_after(&mut self, steps: u64, seed: u64) {
        self.supply = Some(steps);
        self.tear = Random(seed);
    }

    /// The supply is back.
    pub fn power_on(&mut self) {
        self.dead = false;
        self.supply = None;
    }

    /// Fills a sector with what a torn erase may leave.
    fn tear_sector(&mut self, words: std::ops::Range<usize>) {
        let random = &mut self.tear;
        let kind = random.below(TORN_ERASES);
        let some = random.below(words.len() as u64) as usize;
        let sector = &mut self.words[words];
        let length = sector.len();
        for (index, word) in sector.iter_mut().enumerate() {
            let noise = random.next() as u32;
            *word = match kind {
                0 => *word,
                1 => ERASED,
                2 => 0,
                3 => noise,
                // Some bits are erased already.
                4 => *word | noise,
                // Some words are, from one end or the other.
                5 if index < some => ERASED,
                6 if index >= length - some => ERASED,
                _ => *word,
            };
        }
    }

    /// Whether the step is carried out; `None` when there is nothing left to carry out anything.
    fn step(&mut self) -> bool {
        self.steps += 1;
        match &mut self.supply {
            None => true,
            Some(0) => {
                self.dead = true;
                false
            }
            Some(left) => {
                *left -= 1;
                true
            }
        }
    }
}

impl ErrorType for Flash {
    type Error = PowerLost;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), PowerLost> {
        if self.dead {
            return Err(PowerLost);
        }
        for (byte, at) in bytes.iter_mut().zip(offset as usize..) {
            *byte = self.words[at / WORD].to_le_bytes()[at % WORD];
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        SECTORS * SECTOR
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), PowerLost> {
        if self.dead {
            return Err(PowerLost);
        }
        let (from, to) = (from as usize, to as usize);
        assert!(from < to && from.is_multiple_of(SECTOR) && to.is_multiple_of(SECTOR), "erase {from}..{to}");
        for sector in from / SECTOR..to / SECTOR {
            let words = sector * SECTOR / WORD..(sector + 1) * SECTOR / WORD;
            self.erases[sector] += 1;
            self.torn_erase = !self.step();
            if self.torn_erase {
                self.tear_sector(words);
                return Err(PowerLost);
            }
            self.words[words].fill(ERASED);
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), PowerLost> {
        if self.dead {
            return Err(PowerLost);
        }
        assert!(aligned(offset as usize) && aligned(bytes.len()), "write {} at {offset}", bytes.len());
        for (bytes, at) in bytes.chunks(WORD).zip(offset as usize / WORD..) {
            let new = u32::from_le_bytes(bytes.try_into().unwrap());
            let old = self.words[at];
            assert!(self.rotten || old == ERASED || new == 0, "word {at}: {new:08x} over {old:08x}");
            if !self.step() {
                self.torn_erase = false;
                let kept = match self.tear.below(4) {
                    0 => ERASED,
                    1 => 0,
                    2 => self.tear.next() as u32,
                    _ => !(1 << self.tear.below(32)),
                };
                self.words[at] = old & (new | kept);
                return Err(PowerLost);
            }
            self.words[at] = old & new;
        }
        Ok(())
    }
}

fn aligned(number: usize) -> bool {
    number.is_multiple_of(WORD)
}
