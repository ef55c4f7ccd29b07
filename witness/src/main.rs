//! `clino-witness`: the firmware image on a second emulator, and two instruction interpreters held against each other.
//!
//! `cargo xtask witness` builds and runs it; see `docs/witness.md`.

mod cpu;
mod image;

use std::path::Path;
use std::process::ExitCode;

const USAGE: &str = "\
Usage: clino-witness image ELF REGISTERS     the image, and docs/registers.md
       clino-witness cpu SEQUENCES CALLS SEED ELF";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match arguments.as_slice() {
        ["image", elf, registers] => witness(Path::new(elf), Path::new(registers)),
        ["cpu", sequences, calls, seed, elf] => match (sequences.parse(), calls.parse(), seed.parse()) {
            (Ok(sequences), Ok(calls), Ok(seed)) => compare(sequences, calls, seed, Path::new(elf)),
            _ => Err(USAGE.to_owned()),
        },
        _ => Err(USAGE.to_owned()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("{why}");
            ExitCode::FAILURE
        }
    }
}

fn read(path: &Path) -> Result<Vec<u8>, String> {
    std::fs::read(path).map_err(|error| format!("{}: {error}", path.display()))
}

/// The image on the second emulator.
fn witness(elf: &Path, registers: &Path) -> Result<(), String> {
    let document = String::from_utf8(read(registers)?).map_err(|error| error.to_string())?;
    let report = image::witness(elf, &read(elf)?, &document)?;
    match report.failed().as_slice() {
        [] => {
            println!("{} checks, all passed", report.count());
            Ok(())
        }
        failed => Err(format!("{} of {} checks failed: {}", failed.len(), report.count(), failed.join("; "))),
    }
}

/// The two interpreters.
fn compare(sequences: u64, calls: u32, seed: u64, elf: &Path) -> Result<(), String> {
    let random = cpu::sequences(sequences, seed);
    print!("random sequences: {random}");
    let (called, reached) = cpu::functions(&read(elf)?, calls, seed)?;
    print!("the image's functions: {reached}\n{called}");
    if random.is_good() && called.is_good() {
        return Ok(());
    }
    Err("the two cores differ in a way that is not decided (witness/src/cpu/known.rs)".to_owned())
}
