//! The flash as `sequential-storage` sees it: three pages that are blank or written, never half erased.
//!
//! ```text
//! sector   0        8                                                    16384
//!          ┌────────┬─────────────────────────────────────────────────────┐
//!          │  mark  │  page: 16 376 bytes                                 │
//!          └────────┴─────────────────────────────────────────────────────┘
//! ```
//!
//! | | |
//! |---|---|
//! | mark | Eight bytes, programmed after the sector was erased to the end. A sector without it reads as blank, whatever is in it. |
//! | erasing a page | clears the mark. Nothing else: one word decides. |
//! | writing to a page | erases the sector first if it has no mark, then marks it. |
//!
//! An erase that is cut off leaves anything at all in a sector. The library tells the state of a page from a few bits at
//! its ends and would take such a sector for one in use; here it has no mark, and is erased again when it is needed.
//! Reading never erases, so that nothing stalls while the gateway starts.
//!
//! What is programmed is read back. A word is programmed only when it is erased, or else cleared whole: the part may
//! turn ones into zeros at any time (RM0090 section 3.6.4).

use embedded_storage::nor_flash::{NorFlash, NorFlashError, NorFlashErrorKind};
use embedded_storage_async::nor_flash as asynchronous;

/// Bytes of a sector: 1 to 3 of the part (RM0090 table 5).
pub const SECTOR: u32 = 16 * 1024;
/// Sectors.
pub const SECTORS: u32 = 3;
/// Bytes that are programmed at once: a word, at 2.7 V and more (RM0090 table 7).
pub const WORD: usize = 4;
/// Bytes of a sector that the library has for itself.
pub const PAGE: u32 = SECTOR.saturating_sub(MARK.len() as u32);
/// Bytes of all pages.
pub const PAGES: u32 = PAGE.saturating_mul(SECTORS);

/// "This sector was erased to the end." Half of its bits are ones.
const MARK: [u8; 8] = *b"\xC1\x1A\x0C\xE5\x5E\xC0\xA1\xBF";
/// No mark any more.
const CLEARED: [u8; MARK.len()] = [0; MARK.len()];
/// A byte that was not programmed since the erase.
const ERASED: u8 = 0xFF;

/// Errors of the flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlashError {
    /// The flash itself says so.
    Driver(NorFlashErrorKind),
    /// It reads other than it was programmed.
    Verify {
        /// Offset of the first wrong word from the beginning of the first sector.
        offset: u32,
    },
    /// An address outside the pages, or across the end of one.
    Address(u32),
}

impl asynchronous::NorFlashError for FlashError {
    fn kind(&self) -> asynchronous::NorFlashErrorKind {
        match self {
            FlashError::Address(_) => asynchronous::NorFlashErrorKind::OutOfBounds,
            FlashError::Driver(_) | FlashError::Verify { .. } => asynchronous::NorFlashErrorKind::Other,
        }
    }
}

/// The three sectors, whatever their driver is: code over a `dyn Sectors` is compiled with this crate, for size, not with the
/// program that has the driver. Offsets begin with the first sector.
pub trait Sectors {
    /// Reads from this offset on.
    ///
    /// # Errors
    /// [`FlashError::Driver`].
    fn read_at(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError>;

    /// Programs whole words from this offset on.
    ///
    /// # Errors
    /// [`FlashError::Driver`].
    fn program_at(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError>;

    /// Erases the sector that begins at this offset.
    ///
    /// # Errors
    /// [`FlashError::Driver`].
    fn erase_at(&mut self, sector: u32) -> Result<(), FlashError>;
}

impl<F: NorFlash> Sectors for F {
    fn read_at(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        const { assert!(F::READ_SIZE == 1, "bytes are read") };
        self.read(offset, bytes).map_err(driver)
    }

    fn program_at(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        const { assert!(F::WRITE_SIZE == WORD, "words are programmed") };
        self.write(offset, bytes).map_err(driver)
    }

    fn erase_at(&mut self, sector: u32) -> Result<(), FlashError> {
        const { assert!(F::ERASE_SIZE == SECTOR as usize, "sectors are erased") };
        self.erase(sector, sector.saturating_add(SECTOR)).map_err(driver)
    }
}

/// An error of a driver, by its kind.
fn driver(error: impl NorFlashError) -> FlashError {
    FlashError::Driver(error.kind())
}

/// The three sectors as pages.
pub struct Pages<'f> {
    flash: &'f mut dyn Sectors,
    erases: u32,
}

impl<'f> Pages<'f> {
    /// Over this flash.
    pub const fn new(flash: &'f mut dyn Sectors) -> Pages<'f> {
        Pages { flash, erases: 0 }
    }

    /// Sectors erased since this was made.
    pub const fn erases(&self) -> u32 {
        self.erases
    }

    /// Whether the sector that begins there was erased to the end and is in use.
    fn is_marked(&mut self, sector: u32) -> Result<bool, FlashError> {
        let mut mark = CLEARED;
        self.flash.read_at(sector, &mut mark)?;
        Ok(mark == MARK)
    }

    /// Whether nothing is in use: nothing was ever stored. Looks at the marks alone.
    pub fn is_blank(&mut self) -> Result<bool, FlashError> {
        for sector in (0..SECTORS).map(|sector| sector.saturating_mul(SECTOR)) {
            if self.is_marked(sector)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    fn read(&mut self, address: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        let place = Place::of(address, bytes.len())?;
        if self.is_marked(place.sector)? {
            return self.flash.read_at(place.offset, bytes);
        }
        bytes.fill(ERASED);
        Ok(())
    }

    fn write(&mut self, address: u32, bytes: &[u8]) -> Result<(), FlashError> {
        let place = Place::of(address, bytes.len())?;
        if !self.is_marked(place.sector)? {
            self.erases = self.erases.saturating_add(1);
            self.flash.erase_at(place.sector)?;
            self.program(place.sector, &MARK)?;
        }
        self.program(place.offset, bytes)
    }

    fn erase(&mut self, page: u32) -> Result<(), FlashError> {
        let sector = Place::of(page, 0)?.sector;
        if self.is_marked(sector)? {
            self.program(sector, &CLEARED)?;
        }
        Ok(())
    }

    /// Programs and reads back, word by word.
    fn program(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        self.flash.program_at(offset, bytes)?;
        let words = bytes.chunks(WORD).zip((offset..).step_by(WORD));
        for (word, offset) in words {
            let mut seen = [0; WORD];
            self.flash.read_at(offset, &mut seen)?;
            if word != seen {
                return Err(FlashError::Verify { offset });
            }
        }
        Ok(())
    }
}

/// Where an address of the pages is in flash.
struct Place {
    /// Offset of its sector.
    sector: u32,
    /// Its own offset.
    offset: u32,
}

impl Place {
    fn of(address: u32, length: usize) -> Result<Place, FlashError> {
        let (page, within) = (address / PAGE, address % PAGE);
        let fits = u32::try_from(length).is_ok_and(|length| length <= PAGE.saturating_sub(within));
        if page >= SECTORS || !fits {
            return Err(FlashError::Address(address));
        }
        let sector = page.saturating_mul(SECTOR);
        let offset = sector.saturating_add(MARK.len() as u32).saturating_add(within);
        Ok(Place { sector, offset })
    }
}

impl asynchronous::ErrorType for Pages<'_> {
    type Error = FlashError;
}

impl asynchronous::ReadNorFlash for Pages<'_> {
    const READ_SIZE: usize = WORD;

    async fn read(&mut self, address: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        Pages::read(self, address, bytes)
    }

    fn capacity(&self) -> usize {
        PAGES as usize
    }
}

impl asynchronous::NorFlash for Pages<'_> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE as usize;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        (from..to).step_by(PAGE as usize).try_for_each(|page| Pages::erase(self, page))
    }

    async fn write(&mut self, address: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        Pages::write(self, address, bytes)
    }
}
