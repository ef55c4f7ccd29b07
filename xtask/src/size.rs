//! Flash and RAM of the firmware images, and the size of each part of the code.

use std::collections::BTreeMap;
use std::fs;
use std::ops::Range;
use std::path::Path;

use object::elf::PT_LOAD;
use object::read::elf::{ElfFile32, ProgramHeader};
use object::{Endianness, Object, ObjectSymbol, SymbolKind};
use serde::Deserialize;

use crate::command::{self, Failure, Outcome};
use crate::firmware::{self, MODBUS_ONLY, SHIPPED, Variant, WITHOUT_CONSOLE, WITHOUT_LOG};
use crate::steps::Steps;

/// The table of budgets, below the workspace's root.
const BUDGETS: &str = "budgets.toml";

/// Sectors 1 to 3 of flash: the stored configuration. Nothing of the image may be there.
const CONFIGURATION: Range<u32> = 0x0800_4000..0x0801_0000;

/// First address above the flash.
const RAM_START: u32 = 0x2000_0000;

/// What the images may take, in bytes. Other tables of the file are not for this command.
#[derive(Deserialize)]
struct Budgets {
    flash: Budget,
    flash_without_console: Budget,
    flash_modbus_only: Budget,
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
            return Err(Failure::new(format!("over the budget of {most} bytes: {what}")));
        }
        Ok(())
    }
}

/// The images whose sizes are checked.
pub const MEASURED: [Variant; 4] = [WITHOUT_LOG, WITHOUT_CONSOLE, MODBUS_ONLY, SHIPPED];

/// Builds the images and [`check`]s them; then how large each part of the code is.
pub fn run() -> Outcome {
    let mut steps = Steps::new("size");
    firmware::build_all(&mut steps, &MEASURED)?;
    let checked = check();
    parts()?;
    checked
}

/// Prints the sizes of the images; fails when one is over its budget.
pub fn check() -> Outcome {
    let budgets = Budgets::read()?;
    print("image with its log", &SHIPPED.elf())?;
    let (all, ram) = print("image without its log", &WITHOUT_LOG.elf())?;
    let (no_console, _) = print("without console", &WITHOUT_CONSOLE.elf())?;
    let (modbus, _) = print("Modbus only", &MODBUS_ONLY.elf())?;
    let results = [
        budgets.flash.compare("flash, everything but the log", all),
        budgets.flash_without_console.compare("flash, no console", no_console),
        budgets.flash_modbus_only.compare("flash, no console, no storage", modbus),
        budgets.static_ram.compare("static RAM", ram),
    ];
    results.into_iter().collect()
}

/// Parts of the code: what the name of a function of theirs begins with, or holds first.
const PARTS: [&str; 12] = [
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

/// Prints how much code each part has in each image; what a part takes along with it shows in the images without it.
fn parts() -> Outcome {
    println!("\n{:<22}{:>12}{:>18}{:>14}", "bytes of code", "everything", "without console", "Modbus only");
    let images = [WITHOUT_LOG, WITHOUT_CONSOLE, MODBUS_ONLY].map(|variant| by_part(&variant.elf()));
    let [all, no_console, modbus] = images;
    let (all, no_console, modbus) = (all?, no_console?, modbus?);
    for part in PARTS.into_iter().chain(["other"]) {
        let of = |image: &BTreeMap<&str, u64>| image.get(part).copied().unwrap_or(0);
        println!("{part:<22}{:>12}{:>18}{:>14}", of(&all), of(&no_console), of(&modbus));
    }
    Ok(())
}

/// Bytes of the functions of each part of an image.
fn by_part(elf: &Path) -> Result<BTreeMap<&'static str, u64>, Failure> {
    let failed = |why: &dyn std::fmt::Display| Failure::new(format!("{}: {why}", elf.display()));
    let bytes = fs::read(elf).map_err(|error| failed(&error))?;
    let file = ElfFile32::<Endianness>::parse(&*bytes).map_err(|error| failed(&error))?;
    let mut sizes = BTreeMap::new();
    for symbol in file.symbols().filter(|symbol| symbol.kind() == SymbolKind::Text) {
        *sizes.entry(part_of(symbol.name().unwrap_or_default())).or_insert(0) += symbol.size();
    }
    Ok(sizes)
}

/// The part that a function is of: the first that its name mentions.
fn part_of(name: &str) -> &'static str {
    let mentioned = PARTS.into_iter().filter_map(|part| Some((name.find(part)?, part)));
    mentioned.min().map_or("other", |(_, part)| part)
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
