//! Flash and RAM of the firmware image.

use std::fs;
use std::ops::Range;
use std::path::Path;

use object::Endianness;
use object::elf::PT_LOAD;
use object::read::elf::{ElfFile32, ProgramHeader};

use crate::command::{Failure, Outcome};
use crate::firmware;

/// Bytes of flash the image without its log is to take in the end. It takes twice that since it sets sensors up, judges
/// values, and talks to people and to Modbus masters.
const FLASH_GOAL: u64 = 64 * 1024;
/// Bytes of flash it must not grow beyond meanwhile.
const FLASH_BUDGET: u64 = 180 * 1024;
/// Bytes of RAM for its static data, the stack not included.
const RAM_BUDGET: u64 = 24 * 1024;

/// Sectors 1 to 3 of flash: the stored configuration. Nothing of the image may be there.
const CONFIGURATION: Range<u32> = 0x0800_4000..0x0801_0000;

/// First address above the flash.
const RAM_START: u32 = 0x2000_0000;

/// Builds the image with and without its log and prints their sizes; fails when the latter is over its budget.
pub fn run() -> Outcome {
    print("image with its log", &firmware::build()?)?;
    let (flash, ram) = print("image without its log", &firmware::build_without_log()?)?;
    if flash > FLASH_BUDGET || ram > RAM_BUDGET {
        return Err(Failure::new(format!(
            "the image is over its budget of {FLASH_BUDGET} bytes of flash and {RAM_BUDGET} bytes of RAM"
        )));
    }
    Ok(())
}

/// Prints the size of an image and returns it: bytes of flash, bytes of static RAM.
pub fn print(what: &str, elf: &Path) -> Result<(u64, u64), Failure> {
    let bytes = fs::read(elf).map_err(|error| Failure::new(format!("{}: {error}", elf.display())))?;
    let (flash, ram) =
        measure(&bytes).map_err(|error| Failure::new(format!("{}: {error}", elf.display())))?;
    if let Some(address) =
        misplaced(&bytes).map_err(|error| Failure::new(format!("{}: {error}", elf.display())))?
    {
        let why = format!("the segment at {address:#010x} is in the sectors of the stored configuration");
        return Err(Failure::new(format!("{}: {why}", elf.display())));
    }
    let goal = if flash > FLASH_GOAL { "missed" } else { "met" };
    println!("{what}: {flash} bytes of flash (goal {FLASH_GOAL}: {goal}), {ram} bytes of static RAM");
    Ok((flash, ram))
}

/// The address of something in the sectors that hold the configuration: writing the image to flash would destroy it.
fn misplaced(elf: &[u8]) -> object::Result<Option<u32>> {
    let file = ElfFile32::<Endianness>::parse(elf)?;
    let endian = file.endian();
    let loaded = file.elf_program_headers().iter().filter(|header| header.p_type(endian) == PT_LOAD);
    let segments = loaded.map(|header| (header.p_paddr(endian), header.p_filesz(endian)));
    let there = |&(start, length): &(u32, u32)| {
        length > 0 && start < CONFIGURATION.end && start.saturating_add(length) > CONFIGURATION.start
    };
    let mut segments = segments.filter(there);
    Ok(segments.next().map(|(start, _)| start))
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
