//! What is in an image: flash, static RAM, and how much of the code each part has.

use std::collections::BTreeMap;
use std::fs;
use std::ops::Range;
use std::path::Path;

use object::elf::PT_LOAD;
use object::read::elf::{ElfFile32, ProgramHeader};
use object::{Endianness, Object, ObjectSymbol, SymbolKind};

use crate::command::Failure;

/// Sectors 1 to 3 of flash: the stored configuration. Nothing of the image may be there.
const CONFIGURATION: Range<u32> = 0x0800_4000..0x0801_0000;

/// First address above the flash.
const RAM_START: u32 = 0x2000_0000;

/// What stands for the code of none of the [`PARTS`].
pub const OTHER: &str = "other";

/// Parts of the code: what the name of a function of theirs begins with, or holds first.
pub const PARTS: [&str; 12] = [
    "clino_console",
    "clino_commissioning",
    "clino_storage",
    "sequential_storage",
    "clino_modbus",
    "clino_gateway",
    "clino_bus",
    "clino_codec",
    "clino_recovery",
    "clino_firmware",
    "compiler_builtins",
    "core",
];

/// What an image takes, in bytes.
pub struct Image {
    /// What is written to flash, initial values of RAM included.
    pub flash: u64,
    /// What lies in RAM.
    pub ram: u64,
    /// The functions of each part.
    pub code: BTreeMap<&'static str, u64>,
}

impl Image {
    /// Reads an ELF file.
    ///
    /// # Errors
    /// It is none, or it has something in the sectors of the stored configuration.
    pub fn read(elf: &Path) -> Result<Image, Failure> {
        let failed = |why: &dyn std::fmt::Display| Failure::new(format!("{}: {why}", elf.display()));
        let bytes = fs::read(elf).map_err(|error| failed(&error))?;
        let file = ElfFile32::<Endianness>::parse(&*bytes).map_err(|error| failed(&error))?;
        if let Some(address) = misplaced(&file) {
            let why = format!("the segment at {address:#010x} is in the sectors of the stored configuration");
            return Err(failed(&why));
        }
        let (flash, ram) = measure(&file);
        let mut code = BTreeMap::new();
        for symbol in file.symbols().filter(|symbol| symbol.kind() == SymbolKind::Text) {
            *code.entry(part_of(symbol.name().unwrap_or_default())).or_insert(0) += symbol.size();
        }
        Ok(Image { flash, ram, code })
    }

    /// Bytes of a part's functions.
    pub fn code_of(&self, part: &str) -> u64 {
        self.code.get(part).copied().unwrap_or(0)
    }
}

type Elf<'a> = ElfFile32<'a, Endianness>;

/// The part that a function is of: the first that its name mentions.
fn part_of(name: &str) -> &'static str {
    let mentioned = PARTS.into_iter().filter_map(|part| Some((name.find(part)?, part)));
    mentioned.min().map_or(OTHER, |(_, part)| part)
}

/// The address of something in the sectors that hold the configuration: writing the image to flash would destroy it.
fn misplaced(file: &Elf<'_>) -> Option<u32> {
    let endian = file.endian();
    let loaded = file.elf_program_headers().iter().filter(|header| header.p_type(endian) == PT_LOAD);
    let segments = loaded.map(|header| (header.p_paddr(endian), header.p_filesz(endian)));
    let there = |&(start, length): &(u32, u32)| {
        length > 0 && start < CONFIGURATION.end && start.saturating_add(length) > CONFIGURATION.start
    };
    let mut segments = segments.filter(there);
    segments.next().map(|(start, _)| start)
}

/// What is written to flash (initial values of RAM included), and what lies in RAM.
fn measure(file: &Elf<'_>) -> (u64, u64) {
    let endian = file.endian();
    let loaded = || file.elf_program_headers().iter().filter(|header| header.p_type(endian) == PT_LOAD);
    let flash = loaded().map(|header| u64::from(header.p_filesz(endian))).sum();
    let in_ram = loaded().filter(|header| header.p_vaddr(endian) >= RAM_START);
    let ram = in_ram.map(|header| u64::from(header.p_memsz(endian))).sum();
    (flash, ram)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_function_is_of_the_part_that_its_name_mentions_first() {
        for (name, part) in [
            ("_ZN13clino_console5shell5Shell4poll17h0123456789abcdefE", "clino_console"),
            ("_ZN64_$LT$clino_codec..t7..Frame$u20$as$u20$core..fmt..Debug$GT$3fmt17hE", "clino_codec"),
            ("_ZN17compiler_builtins3mem6memcpy17hE", "compiler_builtins"),
            ("USART1", "other"),
        ] {
            assert_eq!(part_of(name), part, "{name}");
        }
    }
}
