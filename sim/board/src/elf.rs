//! The firmware image: the flash contents of the ELF file, and its symbols.
//!
//! Only what the chip gets counts: loadable segments at their physical (load) addresses, gaps filled with the
//! erased value. Flash and RAM bounds are those of the board's chip.

use crate::flash;
use crate::model::BoardModel;
use object::read::elf::{ElfFile32, FileHeader, ProgramHeader};
use object::{Endianness, Object, ObjectSymbol, elf};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// First address of flash.
pub const FLASH_BASE: u32 = 0x0800_0000;
/// What erased flash reads.
const ERASED: u8 = 0xff;

/// A firmware image in the flash of a board.
#[derive(Clone, Debug)]
pub struct Image {
    model: BoardModel,
    flash: Vec<u8>,
    symbols: BTreeMap<String, u32>,
}

/// Why a file is not an image for this board.
#[derive(Debug)]
pub enum ElfError {
    /// The file does not exist.
    Missing(PathBuf),
    /// The file cannot be read.
    Unreadable(PathBuf, std::io::Error),
    /// Not a 32-bit little-endian ELF file.
    NotElf(String),
    /// For another processor; the ELF machine number.
    WrongProcessor(u16),
    /// Nothing to load.
    Empty,
    /// A segment lies outside flash: built for another chip.
    OutsideFlash {
        /// The board.
        model: BoardModel,
        /// Its load address.
        address: u32,
        /// Its length in bytes.
        length: u32,
    },
    /// The vector table at the beginning of flash does not fit this chip.
    BadVectors {
        /// The board.
        model: BoardModel,
        /// Initial stack pointer.
        stack: u32,
        /// Reset vector.
        reset: u32,
    },
}

impl Image {
    /// Reads the ELF file at `path`, for this board.
    ///
    /// # Errors
    ///
    /// Any [`ElfError`].
    pub fn read(path: &Path, model: BoardModel) -> Result<Image, ElfError> {
        let bytes = std::fs::read(path).map_err(|error| match error.kind() {
            std::io::ErrorKind::NotFound => ElfError::Missing(path.to_path_buf()),
            _ => ElfError::Unreadable(path.to_path_buf(), error),
        })?;
        Image::parse(&bytes, model)
    }

    /// Takes the ELF file `bytes` apart, for this board.
    ///
    /// # Errors
    ///
    /// Any [`ElfError`] but [`ElfError::Missing`] and [`ElfError::Unreadable`].
    pub fn parse(bytes: &[u8], model: BoardModel) -> Result<Image, ElfError> {
        let not_elf = |error: object::Error| ElfError::NotElf(error.to_string());
        let file = ElfFile32::<Endianness>::parse(bytes).map_err(not_elf)?;
        let endian = file.endian();
        let machine = file.elf_header().e_machine(endian).0;
        if endian != Endianness::Little || machine != elf::EM_ARM.0 {
            return Err(ElfError::WrongProcessor(machine));
        }
        let mut flash = Vec::new();
        for header in file.elf_program_headers() {
            if header.p_type(endian) != elf::PT_LOAD || header.p_filesz(endian) == 0 {
                continue;
            }
            let data = header
                .data(endian, bytes)
                .map_err(|()| ElfError::NotElf("a segment lies outside the file".into()))?;
            place(model, &mut flash, header.p_paddr(endian), data)?;
        }
        check_vectors(model, &flash)?;
        let symbols = file
            .symbols()
            .filter_map(|symbol| Some((symbol.name().ok()?.to_string(), symbol.address() as u32)))
            .filter(|(name, _)| !name.is_empty())
            .collect();
        Ok(Image { model, flash, symbols })
    }

    /// An image of `words` from the beginning of flash, for tests.
    #[cfg(test)]
    pub(crate) fn of_words(words: &[u32]) -> Image {
        let flash = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        Image { model: BoardModel::default(), flash, symbols: BTreeMap::new() }
    }

    /// The same with a symbol, for tests.
    #[cfg(test)]
    pub(crate) fn with_symbol(mut self, name: &str, address: u32) -> Image {
        self.symbols.insert(name.to_owned(), address);
        self
    }

    /// The board that it is in.
    pub fn model(&self) -> BoardModel {
        self.model
    }

    /// The same in another board, whether it is for that or not.
    #[must_use]
    pub fn put_into(self, model: BoardModel) -> Image {
        Image { model, ..self }
    }

    /// Contents of flash from its first address.
    pub fn flash(&self) -> &[u8] {
        &self.flash
    }

    /// The same with these contents of the sectors that firmware writes to, as [`Board::stored`](crate::Board::stored)
    /// hands them over: the next power-up.
    ///
    /// # Errors
    ///
    /// [`ElfError::OutsideFlash`] if it is more than the sectors hold.
    pub fn with_stored(mut self, contents: &[u8]) -> Result<Image, ElfError> {
        if contents.len() > flash::LENGTH {
            let (model, address) = (self.model, flash::ADDRESS);
            return Err(ElfError::OutsideFlash { model, address, length: contents.len() as u32 });
        }
        place(self.model, &mut self.flash, flash::ADDRESS, contents)?;
        Ok(self)
    }

    /// The same with these contents from an address of flash on.
    ///
    /// # Errors
    ///
    /// [`ElfError::OutsideFlash`] if they are not within flash.
    pub fn with_flash(mut self, address: u32, contents: &[u8]) -> Result<Image, ElfError> {
        place(self.model, &mut self.flash, address, contents)?;
        Ok(self)
    }

    /// Address of the symbol called `name`.
    pub fn symbol(&self, name: &str) -> Option<u32> {
        self.symbols.get(name).copied()
    }

    /// Names and addresses of all symbols, in alphabetical order.
    pub fn symbols(&self) -> impl Iterator<Item = (&str, u32)> {
        self.symbols.iter().map(|(name, address)| (name.as_str(), *address))
    }

    /// The bytes of flash from `address` on.
    pub(crate) fn bytes(&self, address: u32, length: u32) -> Option<&[u8]> {
        let start = address.checked_sub(FLASH_BASE)? as usize;
        self.flash.get(start..start.checked_add(length as usize)?)
    }

    /// The word of flash at `address`.
    pub(crate) fn word(&self, address: u32) -> Option<u32> {
        self.bytes(address, 4)?.first_chunk().map(|bytes| u32::from_le_bytes(*bytes))
    }
}

fn place(model: BoardModel, flash: &mut Vec<u8>, address: u32, data: &[u8]) -> Result<(), ElfError> {
    let length = data.len() as u32;
    let outside = ElfError::OutsideFlash { model, address, length };
    let Some(start) = address.checked_sub(FLASH_BASE) else { return Err(outside) };
    let Some(end) = start.checked_add(length).filter(|end| *end <= model.flash_size()) else {
        return Err(outside);
    };
    let (start, end) = (start as usize, end as usize);
    if flash.len() < end {
        flash.resize(end, ERASED);
    }
    flash[start..end].copy_from_slice(data);
    Ok(())
}

fn check_vectors(model: BoardModel, flash: &[u8]) -> Result<(), ElfError> {
    let (Some(stack), Some(reset)) =
        (flash.first_chunk(), flash.get(4..).and_then(|rest| rest.first_chunk()))
    else {
        return Err(ElfError::Empty);
    };
    let (stack, reset) = (u32::from_le_bytes(*stack), u32::from_le_bytes(*reset));
    let in_ram = model.stacks().any(|memory| memory.contains(&stack));
    let end = FLASH_BASE + flash.len() as u32;
    if in_ram && (FLASH_BASE..end).contains(&reset) && reset & 1 == 1 {
        Ok(())
    } else {
        Err(ElfError::BadVectors { model, stack, reset })
    }
}

impl std::fmt::Display for ElfError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            ElfError::Missing(path) => write!(f, "{}: no such file", path.display()),
            ElfError::Unreadable(path, error) => write!(f, "{}: {error}", path.display()),
            ElfError::NotElf(why) => write!(f, "not an image for a 32-bit ARM: {why}"),
            ElfError::WrongProcessor(machine) => {
                write!(f, "built for another processor (ELF machine {machine}, little-endian ARM is 40)")
            }
            ElfError::Empty => write!(f, "contains nothing that goes into flash"),
            ElfError::OutsideFlash { model, address, length } => write!(
                f,
                "built for another chip: {length} bytes at {address:#010x} are outside the {}'s flash \
                 ({FLASH_BASE:#010x}, {} KiB)",
                model.chip(),
                model.flash_size() / 1024
            ),
            ElfError::BadVectors { model, stack, reset } => write!(
                f,
                "built for another chip: initial stack pointer {stack:#010x} and reset vector {reset:#010x} \
                 do not fit the {}'s RAM and flash",
                model.chip()
            ),
        }
    }
}

impl std::error::Error for ElfError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            ElfError::Unreadable(_, error) => Some(error),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ARM: u16 = 40;
    const VECTORS: [u32; 2] = [0x2002_0000, 0x0800_0009];

    /// An ELF file with one segment that holds `words` and is loaded at `address`.
    fn elf(machine: u16, address: u32, words: &[u32]) -> Vec<u8> {
        let data: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        let mut file = b"\x7fELF\x01\x01\x01".to_vec();
        file.resize(16, 0);
        let half = |file: &mut Vec<u8>, values: &[u16]| {
            file.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        };
        let word = |file: &mut Vec<u8>, values: &[u32]| {
            file.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        };
        half(&mut file, &[2, machine]);
        // Version, entry, program headers right after this one, no section headers, flags.
        word(&mut file, &[1, 0, 52, 0, 0]);
        half(&mut file, &[52, 32, 1, 40, 0, 0]);
        // PT_LOAD, offset, virtual and physical address, sizes in file and memory, flags, alignment.
        let length = data.len() as u32;
        word(&mut file, &[1, 84, 0x2000_0000, address, length, length, 5, 4]);
        file.extend(data);
        file
    }

    fn parse(bytes: &[u8]) -> Result<Image, ElfError> {
        Image::parse(bytes, BoardModel::default())
    }

    #[test]
    fn a_segment_goes_to_its_load_address() {
        let image = parse(&elf(ARM, FLASH_BASE, &[VECTORS[0], VECTORS[1], 0xdead_beef])).unwrap();
        assert_eq!(image.flash()[..4], [0x00, 0x00, 0x02, 0x20]);
        assert_eq!(image.flash()[8..], [0xef, 0xbe, 0xad, 0xde]);
    }

    #[test]
    fn a_missing_file_says_so() {
        let error = Image::read(Path::new("no/such/image"), BoardModel::default()).unwrap_err();
        assert!(matches!(error, ElfError::Missing(_)), "{error}");
    }

    #[test]
    fn what_is_not_for_this_chip_is_refused() {
        assert!(matches!(parse(b"#!/bin/sh"), Err(ElfError::NotElf(_))));
        assert!(matches!(parse(&elf(243, FLASH_BASE, &VECTORS)), Err(ElfError::WrongProcessor(243))));
        assert!(matches!(parse(&elf(ARM, FLASH_BASE, &[])), Err(ElfError::Empty)));
        // Flash at zero, as on other vendors' chips; beyond the end; RAM of another chip.
        for address in [0, FLASH_BASE + 1024 * 1024 - 4] {
            let parsed = parse(&elf(ARM, address, &VECTORS));
            assert!(matches!(parsed, Err(ElfError::OutsideFlash { length: 8, .. })), "{address:#x}");
        }
        let parsed = parse(&elf(ARM, FLASH_BASE, &[0x2005_0000, VECTORS[1]]));
        assert!(matches!(parsed, Err(ElfError::BadVectors { stack: 0x2005_0000, .. })));
    }

    #[test]
    fn each_board_has_its_own_memories() {
        let parse = |model, address, stack| Image::parse(&elf(ARM, address, &[stack, VECTORS[1], 0]), model);
        let core_coupled = 0x1000_6000;
        assert!(parse(BoardModel::F407Disc1, FLASH_BASE, core_coupled).is_ok());
        let parsed = parse(BoardModel::NucleoF446re, FLASH_BASE, core_coupled);
        assert!(matches!(parsed, Err(ElfError::BadVectors { stack: 0x1000_6000, .. })));
        let parsed = parse(BoardModel::NucleoF446re, FLASH_BASE + 512 * 1024, VECTORS[0]);
        assert!(
            parsed
                .is_err_and(|error| error.to_string().contains("STM32F446RE's flash (0x08000000, 512 KiB)"))
        );
    }
}
