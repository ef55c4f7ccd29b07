//! The sectors of flash that the firmware writes: 1 to 3, 16 KiB each, for the configuration; the last, 128 KiB, for the tally of
//! power-ups. No code is in either (`memory.x`).
//!
//! Registers, not the HAL: its `NorFlash` erases 128 KiB at once, which is all sectors from 0 to 4, it programs bytes
//! (four times as long, four times as much to be torn), and it panics if the flash does not unlock.
//!
//! The part has a single bank: while it programs a word (16 µs) or erases a sector (250 to 500 ms, DS8626 table 40)
//! every access to flash waits, and as code is there, so does the core with all its interrupts. Nothing in RAM could
//! go on either, as the gateway's code is all in flash.
//!
//! Source: RM0090 sections 3.6 (erase and program) and 3.9 (registers).

use core::ptr;

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};

use crate::board::FlashRegisters;
use crate::watchdog;

/// Address of the first sector; offsets count from here.
const BASE: usize = 0x0800_4000;
/// Number of the first sector.
const FIRST_SECTOR: u32 = 1;
/// Bytes of a sector.
const SECTOR: u32 = 16 * 1024;
/// Bytes of all three.
const SIZE: u32 = 3 * SECTOR;
unsafe extern "C" {
    /// The last sector of flash, which is only ever programmed (`memory.x`).
    static __tally_start: u8;
}

/// Where it begins.
fn tally_base() -> usize {
    ptr::addr_of!(__tally_start).addr()
}

/// Its bytes.
const TALLY_SIZE: u32 = 128 * 1024;
/// Bytes programmed at once, at 2.7 V and more.
const WORD: usize = 4;

/// The keys that unlock the control register (section 3.6.1).
const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];
/// All error flags of the status register, which are cleared by writing ones: PGSERR, PGPERR, PGAERR, WRPERR, OPERR.
const ERRORS: u32 = 0b1111_0010;

/// An operation of the flash has failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Error {
    /// Error flags of the status register.
    Status(u32),
    /// The control register does not unlock until the next reset.
    Locked,
    /// Not a whole word, not a whole sector, or outside of the sectors.
    Address(u32),
}

impl NorFlashError for Error {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Error::Status(_) | Error::Locked => NorFlashErrorKind::Other,
            Error::Address(_) => NorFlashErrorKind::OutOfBounds,
        }
    }
}

/// The sectors of the configuration, and nothing else of flash.
pub struct ConfigurationFlash {
    registers: FlashRegisters,
}

impl ConfigurationFlash {
    /// Takes the flash interface; its wait states and caches stay as they are.
    pub fn new(registers: FlashRegisters) -> ConfigurationFlash {
        ConfigurationFlash { registers }
    }
}

/// Does this with the control register unlocked.
fn unlocked(flash: &FlashRegisters, work: impl FnOnce() -> Result<(), Error>) -> Result<(), Error> {
    wait(flash);
    // SAFETY: writing ones to flags clears them, whatever they are.
    flash.sr().write(|w| unsafe { w.bits(ERRORS) });
    if flash.cr().read().lock().bit_is_set() {
        for key in KEYS {
            // SAFETY: the two keys in this order are what the register takes.
            flash.keyr().write(|w| unsafe { w.key().bits(key) });
        }
    }
    if flash.cr().read().lock().bit_is_set() {
        return Err(Error::Locked);
    }
    let done = work();
    flash.cr().write(|w| w.lock().set_bit());
    done
}

/// Programs whole words from this address on, which is in one of the sectors of this file.
fn program(flash: &FlashRegisters, to: usize, bytes: &[u8]) -> Result<(), Error> {
    let (words, rest) = bytes.as_chunks::<WORD>();
    if !to.is_multiple_of(WORD) || !rest.is_empty() {
        return Err(Error::Address(to as u32));
    }
    unlocked(flash, || {
        flash.cr().write(|w| w.psize().psize32().pg().set_bit().lock().clear_bit());
        for (word, at) in words.iter().zip((to..).step_by(WORD)) {
            // SAFETY: aligned, and in a sector of this file, which is no Rust object. The controller takes it, and sets
            // an error flag if it does not.
            unsafe { ptr::write_volatile(at as *mut u32, u32::from_le_bytes(*word)) };
            finish(flash)?;
        }
        Ok(())
    })
}

/// Reads from this address on, which is in one of the sectors of this file.
fn read(from: usize, bytes: &mut [u8]) {
    for (byte, at) in bytes.iter_mut().zip(from..) {
        // SAFETY: the sectors are always readable and no Rust object. Volatile, because programming changes them behind
        // the compiler's back.
        *byte = unsafe { ptr::read_volatile(at as *const u8) };
    }
}

/// Waits until the flash is done. The core stands still most of that time.
fn wait(flash: &FlashRegisters) {
    while flash.sr().read().bsy().bit_is_set() {}
}

/// Waits, and checks the result.
fn finish(flash: &FlashRegisters) -> Result<(), Error> {
    wait(flash);
    match flash.sr().read().bits() & ERRORS {
        0 => Ok(()),
        errors => Err(Error::Status(errors)),
    }
}

/// The address of these bytes at an offset, if they are within `size` bytes from `base` on.
fn address(base: usize, size: u32, offset: u32, length: usize) -> Result<usize, Error> {
    let fits = u32::try_from(length).is_ok_and(|length| length <= size.saturating_sub(offset));
    if fits { Ok(base.saturating_add(offset as usize)) } else { Err(Error::Address(offset)) }
}

/// Resets the data cache, which may hold data of flash that was erased (section 3.6.3). A cache is reset when it is off.
fn flush(flash: &FlashRegisters) {
    if flash.acr().read().dcen().bit_is_set() {
        flash.acr().modify(|_, w| w.dcen().clear_bit());
        flash.acr().modify(|_, w| w.dcrst().set_bit());
        flash.acr().modify(|_, w| w.dcrst().clear_bit());
        flash.acr().modify(|_, w| w.dcen().set_bit());
    }
}

impl ErrorType for ConfigurationFlash {
    type Error = Error;
}

impl ReadNorFlash for ConfigurationFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        read(address(BASE, SIZE, offset, bytes.len())?, bytes);
        Ok(())
    }

    fn capacity(&self) -> usize {
        SIZE as usize
    }
}

impl NorFlash for ConfigurationFlash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = SECTOR as usize;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Error> {
        if !from.is_multiple_of(SECTOR) || !to.is_multiple_of(SECTOR) || to > SIZE {
            return Err(Error::Address(from));
        }
        let sectors = from / SECTOR..to / SECTOR;
        let flash = &self.registers;
        unlocked(flash, || {
            for sector in sectors {
                let number = FIRST_SECTOR.saturating_add(sector) as u8;
                // SAFETY: the number is 1 to 3, see above: sectors without code.
                flash.cr().write(|w| unsafe {
                    w.psize().psize32().ser().set_bit().snb().bits(number).lock().clear_bit()
                });
                // The core stands still from here on, the watchdog does not.
                watchdog::look();
                flash.cr().modify(|_, w| w.strt().set_bit());
                let done = finish(flash);
                flush(flash);
                done?;
            }
            Ok(())
        })
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        program(&self.registers, address(BASE, SIZE, offset, bytes.len())?, bytes)
    }
}

/// The sector of the tally of power-ups. It is never erased.
pub struct TallyFlash {
    registers: FlashRegisters,
}

impl TallyFlash {
    /// Takes the flash interface for a while.
    pub fn new(registers: FlashRegisters) -> TallyFlash {
        TallyFlash { registers }
    }

    /// Gives it back.
    pub fn release(self) -> FlashRegisters {
        self.registers
    }
}

impl ErrorType for TallyFlash {
    type Error = Error;
}

impl ReadNorFlash for TallyFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        read(address(tally_base(), TALLY_SIZE, offset, bytes.len())?, bytes);
        Ok(())
    }

    fn capacity(&self) -> usize {
        TALLY_SIZE as usize
    }
}

impl NorFlash for TallyFlash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = TALLY_SIZE as usize;

    fn erase(&mut self, from: u32, _: u32) -> Result<(), Error> {
        Err(Error::Address(from))
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        program(&self.registers, address(tally_base(), TALLY_SIZE, offset, bytes.len())?, bytes)
    }
}
