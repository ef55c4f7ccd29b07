//! Flash and RAM of the firmware image.

use std::fs;
use std::path::{Path, PathBuf};

use object::Endianness;
use object::elf::PT_LOAD;
use object::read::elf::{ElfFile32, ProgramHeader};

use crate::command::Failure;
use crate::firmware;

/// Bytes of flash the image is to take in the end. It takes more since it sets sensors up and talks to people.
const FLASH_GOAL: u64 = 64 * 1024;
/// Bytes of flash it must not grow beyond meanwhile.
const FLASH_BUDGET: u64 = 116 * 1024;
/// Bytes of RAM for static data, the stack not included.
const RAM_BUDGET: u64 = 24 * 1024;

/// Sectors 1 to 3 of flash: the stored configuration. Nothing of the image may be there.
const CONFIGURATION: std::ops::Range<u32> = 0x0800_4000..0x0801_0000;

/// First address above the flash.
const RAM_START: u32 = 0x2000_0000;

/// Builds the image and prints its size; fails when it is over its budget. Returns where the image is.
pub fn run() -> Result<PathBuf, Failure> {
    let elf = firmware::build()?;
    let (flash, ram) = print(&elf)?;
    check_sectors(&elf)?;
    if flash > FLASH_BUDGET || ram > RAM_BUDGET {
        return Err(Failure::new(format!(
            "the image is over its budget of {FLASH_BUDGET} bytes of flash and {RAM_BUDGET} bytes of RAM"
        )));
    }
    Ok(elf)
}

/// Prints the size of an image and returns it: bytes of flash, bytes of static RAM.
pub fn print(elf: &Path) -> Result<(u64, u64), Failure> {
    let bytes = fs::read(elf).map_err(|error| Failure::new(format!("{}: {error}", elf.display())))?;
    let (flash, ram) =
        measure(&bytes).map_err(|error| Failure::new(format!("{}: {error}", elf.display())))?;
    let goal = if flash > FLASH_GOAL { "missed" } else { "met" };
    println!("image: {flash} bytes of flash (goal {FLASH_GOAL}: {goal}), {ram} bytes of static RAM");
    Ok((flash, ram))
}

/// Fails if flashing the image would overwrite the stored configuration.
fn check_sectors(elf: &Path) -> Result<(), Failure> {
    let failure = |why: &dyn std::fmt::Display| Failure::new(format!("{}: {why}", elf.display()));
    let bytes = fs::read(elf).map_err(|error| failure(&error))?;
    let file = ElfFile32::<Endianness>::parse(&*bytes).map_err(|error| failure(&error))?;
    let endian = file.endian();
    for header in file.elf_program_headers() {
        let (start, length) = (header.p_paddr(endian), header.p_filesz(endian));
        let loaded = header.p_type(endian) == PT_LOAD && length > 0;
        if loaded && start < CONFIGURATION.end && start.saturating_add(length) > CONFIGURATION.start {
            let why =
                format!("{length} bytes at {start:#010x} are in the sectors of the stored configuration");
            return Err(failure(&why));
        }
    }
    Ok(())
}

/// What is written to flash (initial values of RAM included), and what lies in RAM.
fn measure(elf: &[u8]) -> object::Result<(u64, u64)> {
    let file = ElfFile32::<Endianness>::parse(elf)?;
    let endian = file.endian();
    let loaded = || file.elf_program_headers().iter().filter(|header| header.p_type(endian) == PT_LOAD);
    let flash = loaded().map(|header| u64::from(header.p_filesz(endian))).sum();
    let in_ram = loaded().filter(|header| header.p_vaddr(endian) >= RAM_START);
    let ram = in_ram.map(|header| u64::from(header.p_memsz(endian))).sum();
    Ok((flash, ram))
}
