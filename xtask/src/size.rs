//! Flash and RAM of the firmware image.

use std::fs;
use std::ops::Range;
use std::path::Path;

use object::Endianness;
use object::elf::PT_LOAD;
use object::read::elf::{ElfFile32, ProgramHeader};
use serde::Deserialize;

use crate::command::{self, Failure, Outcome};
use crate::firmware::{self, SHIPPED, WITHOUT_LOG};
use crate::steps::Steps;

/// The table of budgets, below the workspace's root.
const BUDGETS: &str = "budgets.toml";

/// Sectors 1 to 3 of flash: the stored configuration. Nothing of the image may be there.
const CONFIGURATION: Range<u32> = 0x0800_4000..0x0801_0000;

/// First address above the flash.
const RAM_START: u32 = 0x2000_0000;

/// What the image may take, in bytes. Other tables of the file are not for this command.
#[derive(Deserialize)]
struct Budgets {
    flash: Budget,
    static_ram: Budget,
}

#[derive(Deserialize)]
struct Budget {
    most: u64,
    goal: u64,
}

impl Budgets {
    fn read() -> Result<Budgets, Failure> {
        let failed = |error: &dyn std::fmt::Display| Failure::new(format!("{BUDGETS}: {error}"));
        let text = fs::read_to_string(command::root().join(BUDGETS)).map_err(|error| failed(&error))?;
        toml::from_str(&text).map_err(|error| failed(&error))
    }
}

impl Budget {
    /// Prints how far the image is from its goal; fails when it is over its budget.
    fn compare(&self, what: &str, bytes: u64) -> Outcome {
        let Budget { most, goal } = *self;
        let met = if bytes > goal { "missed" } else { "met" };
        println!("{what}: {bytes} of {most} bytes (goal {goal}: {met})");
        if bytes > most {
            return Err(Failure::new(format!("the image is over its budget of {most} bytes of {what}")));
        }
        Ok(())
    }
}

/// Builds the image with and without its log, and [`check`]s them.
pub fn run() -> Outcome {
    let mut steps = Steps::new("size");
    firmware::build_all(&mut steps, &[WITHOUT_LOG, SHIPPED])?;
    check()
}

/// Prints the sizes of the image with and without its log; fails when the latter is over its budget.
pub fn check() -> Outcome {
    let budgets = Budgets::read()?;
    print("image with its log", &SHIPPED.elf())?;
    let (flash, ram) = print("image without its log", &WITHOUT_LOG.elf())?;
    let flash = budgets.flash.compare("flash", flash);
    let ram = budgets.static_ram.compare("static RAM", ram);
    flash.and(ram)
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
    println!("{what}: {flash} bytes of flash, {ram} bytes of static RAM");
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
