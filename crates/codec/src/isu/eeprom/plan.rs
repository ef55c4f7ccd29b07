//! From an image and a wish to the words to write. Source: AN #201 §7.

use core::fmt;

use super::image::{Audit, ChecksumReading, DataWord, Image, total};
use super::packing::{WORDS_PER_DATA_WORD, pack};
use crate::bytes::put;
use crate::isu::{Address, Request, Words};

/// Position of the module address in its data word.
const ADDRESS_SHIFT: u32 = 4;
/// The module address' bits in its data word.
const ADDRESS_MASK: u16 = 0b1111 << ADDRESS_SHIFT;
/// EEPROM words that hold the module address: those for b7…b4.
const ADDRESS_WORDS: usize = 2;

/// What is to be changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Change {
    /// The module's address: 1–14, or 0 as it leaves the factory.
    ModuleAddress(Address),
    /// The null position, in 360/65536°.
    NullPosition(u16),
    /// Auto-shutoff.
    AutoShutoff {
        /// Which bit the caller takes for the switch.
        bit: ShutoffBit,
        /// Whether the module may switch itself off.
        enabled: bool,
    },
}

/// The bit that switches auto-shutoff.
///
/// Its number is unreadable in the available copy of the document; these three fit what is left of it, 0 fits
/// best. The caller has to name one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(u8)]
pub enum ShutoffBit {
    /// b0.
    Bit0 = 0,
    /// b1.
    Bit1 = 1,
    /// b7.
    Bit7 = 7,
}

impl ShutoffBit {
    const fn mask(self) -> u16 {
        match self {
            Self::Bit0 => 1,
            Self::Bit1 => 1 << 1,
            Self::Bit7 => 1 << 7,
        }
    }
}

/// Why there is no plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum PlanError {
    /// The image's checksum is wrong in both readings: the image was misread, or the module needs a
    /// [repair](Plan::repair) first.
    UnsoundChecksum(Audit),
    /// Address 15 belongs to no module.
    ReservedAddress,
}

/// Up to eight consecutive EEPROM words to write, and what is there now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PlannedWrite {
    start: u8,
    count: usize,
    before: [u16; WORDS_PER_DATA_WORD],
    after: [u16; WORDS_PER_DATA_WORD],
}

impl PlannedWrite {
    /// Address of the first word.
    pub const fn start(&self) -> u8 {
        self.start
    }

    /// The words that are there before.
    pub fn before(&self) -> &[u16] {
        self.before.get(..self.count).unwrap_or(&[])
    }

    /// The words to write. Only their two low bits differ from those before.
    pub fn words(&self) -> &[u16] {
        self.after.get(..self.count).unwrap_or(&[])
    }

    /// The command that writes them.
    pub fn request(&self) -> Request {
        Request::WriteEeprom { start: self.start, words: Words::first(self.words()) }
    }

    /// The command that reads them back.
    pub const fn read_back(&self) -> Request {
        Request::ReadEeprom { start: self.start, count: self.count as u8 }
    }
}

/// The writes that make a change and keep the checksum right.
///
/// Between the first and the last write the checksum is wrong. Should power fail there, the module comes up
/// in its Hard Error state, and [`repair`](Self::repair) on a fresh image brings it back.
///
/// ```
/// use clino_codec::isu::eeprom::{Change, ChecksumReading, Image, Plan};
/// use clino_codec::isu::Address;
///
/// let blank = Image::new([0; 256]);
/// let plan = Plan::change(&blank, Change::ModuleAddress(Address::new(3).unwrap())).unwrap();
/// let [address, checksum] = plan.writes() else { panic!() };
/// assert_eq!((address.start(), address.words()), (0x48, &[0b00, 0b11][..]));
/// assert_eq!((checksum.start(), checksum.words()), (0x78, &[0, 0, 0, 0b11, 0, 0, 0, 0][..]));
///
/// let mut changed = blank.clone();
/// plan.apply(&mut changed);
/// assert_eq!(changed.module_address().get(), 3);
/// assert!(changed.audit().is_sound());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Plan {
    writes: [PlannedWrite; 2],
    count: usize,
}

impl Plan {
    /// The writes for a change of a sound image. None, if the image is already as wished.
    ///
    /// # Errors
    /// [`PlanError`], before anything is written.
    pub fn change(image: &Image, change: Change) -> Result<Self, PlanError> {
        let audit = image.audit();
        if !audit.is_sound() {
            return Err(PlanError::UnsoundChecksum(audit));
        }
        let (data_word, mask, bits, skip, count) = match change {
            Change::ModuleAddress(address) if address.is_reserved() => {
                return Err(PlanError::ReservedAddress);
            }
            Change::ModuleAddress(address) => {
                let bits = u16::from(address.get()) << ADDRESS_SHIFT;
                (DataWord::ModuleAddress, ADDRESS_MASK, bits, 0, ADDRESS_WORDS)
            }
            Change::NullPosition(data) => (DataWord::NullPosition, u16::MAX, data, 0, WORDS_PER_DATA_WORD),
            Change::AutoShutoff { bit, enabled } => {
                let bits = if enabled { bit.mask() } else { 0 };
                // The word that holds the bit, and no other.
                let skip = if bit == ShutoffBit::Bit7 { 0 } else { 3 };
                (DataWord::AutoShutoff, bit.mask(), bits, skip, 1)
            }
        };
        let data = image.data(data_word) & !mask | bits;
        let mut plan = Self::NOTHING;
        let growth = plan.add(image, data_word, data, skip, count);
        // New checksum = old − old words + new words: right in whichever reading the old one was.
        let checksum = audit.stored.wrapping_add(growth);
        plan.add(image, DataWord::Checksum, checksum, 0, WORDS_PER_DATA_WORD);
        Ok(plan)
    }

    /// The writes that make a wrong checksum right in that reading. None, if it is right.
    ///
    /// Which reading a module follows shows in its [`Audit`] while it is sound. If that is not known, try
    /// one, reset the module, and try the other should it still report a hardware error.
    pub fn repair(image: &Image, reading: ChecksumReading) -> Self {
        let checksum = image.audit().computed(reading);
        let mut plan = Self::NOTHING;
        plan.add(image, DataWord::Checksum, checksum, 0, WORDS_PER_DATA_WORD);
        plan
    }

    /// The writes in the order in which they must be made; at most two, none when there is nothing to do.
    pub fn writes(&self) -> &[PlannedWrite] {
        self.writes.get(..self.count).unwrap_or(&[])
    }

    /// Makes the change in a copy of the EEPROM, to compare with what is read back.
    pub fn apply(&self, image: &mut Image) {
        for write in self.writes() {
            image.fill(write.start, write.words().iter().copied());
        }
    }

    const NOTHING: Self =
        Self { writes: [PlannedWrite { start: 0, count: 0, before: [0; 8], after: [0; 8] }; 2], count: 0 };

    /// Adds the write of those words of `data_word` that are to hold `data`, unless they do already, and says
    /// how much the sum of all words grows. Only `count` words from `skip` on may differ.
    #[inline(never)]
    fn add(&mut self, image: &Image, data_word: DataWord, data: u16, skip: usize, count: usize) -> u16 {
        let before = image.group(data_word);
        let after = pack(before, data);
        if before == after {
            return 0;
        }
        let growth = total(&after).wrapping_sub(total(&before));
        let start = data_word.start().wrapping_add(skip as u8);
        let write = PlannedWrite { start, count, before: shifted(before, skip), after: shifted(after, skip) };
        put(&mut self.writes, self.count, write);
        self.count = self.count.wrapping_add(1);
        growth
    }
}

/// The words from `skip` on, with zeros behind.
fn shifted(words: [u16; WORDS_PER_DATA_WORD], skip: usize) -> [u16; WORDS_PER_DATA_WORD] {
    let mut shifted = [0; WORDS_PER_DATA_WORD];
    for (to, &from) in shifted.iter_mut().zip(words.iter().skip(skip)) {
        *to = from;
    }
    shifted
}

impl fmt::Display for PlanError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnsoundChecksum(Audit { stored, upper_bits_counted, words_left_out }) => write!(
                f,
                "EEPROM checksum {stored:04X} is neither {upper_bits_counted:04X} nor {words_left_out:04X}"
            ),
            Self::ReservedAddress => write!(f, "address 15 is reserved"),
        }
    }
}

impl core::error::Error for PlanError {}
