//! Flash and RAM of the firmware images against their budgets, and the size of each part.

mod against;
mod image;

use std::fs;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::boards::{self, Board};
use crate::command::{self, Failure, Outcome};
use crate::firmware::{
    self, MODBUS_STORAGE, SHIPPED, T7_MODBUS, TARGET, Variant, WITHOUT_COMMISSIONING, WITHOUT_CONSOLE,
    WITHOUT_ISU, WITHOUT_LOG, WITHOUT_MODBUS, WITHOUT_PWM, WITHOUT_STORAGE,
};
use crate::steps::Steps;

use image::{Image, OTHER};

/// The table of budgets, below the workspace's root.
const BUDGETS: &str = "budgets.toml";

/// What the images may take, in bytes. Other tables of the file are not for this command.
#[derive(Deserialize)]
struct Budgets {
    flash: Budget,
    flash_modbus_storage: Budget,
    flash_t7_modbus: Budget,
    static_ram: Budget,
    codec_t7: Budget,
}

#[derive(Clone, Copy, Deserialize)]
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
    /// Prints how far something is from its goal; fails when it is over its budget.
    fn compare(self, what: &str, bytes: u64) -> Outcome {
        let Budget { most, goal } = self;
        let verdict = if bytes > most {
            "OVER"
        } else if bytes > goal {
            "goal missed"
        } else {
            "goal met"
        };
        println!("{what:<54}{bytes:>10}{most:>10}{goal:>10}  {verdict}");
        if bytes > most {
            return Err(Failure::new(format!("over the budget of {most} bytes: {what}")));
        }
        Ok(())
    }
}

/// The images of the default board whose sizes have budgets, and the shipped one.
pub const MEASURED: [Variant; 4] = [WITHOUT_LOG, MODBUS_STORAGE, T7_MODBUS, SHIPPED];

/// The boards whose images are measured.
const MEASURED_BOARDS: [Board; 2] = [boards::DEFAULT, boards::NUCLEO];

/// A part of the firmware, and what shows what goes with it.
struct Part {
    name: &'static str,
    /// Its crates.
    crates: &'static [&'static str],
    /// An image with it, and the same without.
    with_and_without: Option<(Variant, Variant)>,
}

const ALL_PARTS: [Part; 12] = [
    removable("console", &["clino_console"], WITHOUT_LOG, WITHOUT_CONSOLE),
    removable("commissioning", &["clino_commissioning"], WITHOUT_LOG, WITHOUT_COMMISSIONING),
    removable("storage", &["clino_storage", "sequential_storage"], WITHOUT_CONSOLE, WITHOUT_STORAGE),
    removable("Modbus", &["clino_modbus"], WITHOUT_LOG, WITHOUT_MODBUS),
    removable("ISU bus", &[], WITHOUT_LOG, WITHOUT_ISU),
    removable("PWM inputs", &[], WITHOUT_LOG, WITHOUT_PWM),
    needed("gateway", &["clino_gateway"]),
    needed("bus", &["clino_bus"]),
    needed("codec", &["clino_codec"]),
    needed("recovery", &["clino_recovery"]),
    needed("firmware", &["clino_firmware"]),
    needed("compiler, core, other", &["compiler_builtins", "core", OTHER]),
];

const fn removable(
    name: &'static str,
    crates: &'static [&'static str],
    with: Variant,
    without: Variant,
) -> Part {
    Part { name, crates, with_and_without: Some((with, without)) }
}

const fn needed(name: &'static str, crates: &'static [&'static str]) -> Part {
    Part { name, crates, with_and_without: None }
}

/// `size [--against REV]`.
pub fn run(arguments: &[String]) -> Outcome {
    match arguments {
        [] => {}
        [flag, revision] if flag == "--against" => return against::run(revision),
        _ => {
            let message = String::from("size takes nothing, or --against REV");
            return Err(Failure { message, status: crate::BAD_USAGE });
        }
    }
    let mut steps = Steps::new("size");
    let mut images: Vec<Variant> = Vec::new();
    let of_parts = ALL_PARTS.iter().filter_map(|part| part.with_and_without);
    images.extend(of_parts.flat_map(|(with, without)| [with, without]));
    for board in MEASURED_BOARDS {
        images.extend(MEASURED.map(|variant| variant.on(board)));
    }
    // The shipped one stays where it is looked for: it is built last, once.
    images.retain(|variant| *variant != SHIPPED);
    images.push(SHIPPED);
    let mut wanted: Vec<Variant> = Vec::new();
    for image in images {
        if !wanted.contains(&image) {
            wanted.push(image);
        }
    }
    firmware::build_all(&mut steps, &wanted)?;
    let codec = build_codec(&mut steps)?;
    let budgets = Budgets::read()?;
    parts()?;
    header();
    let mut results: Vec<Outcome> =
        MEASURED_BOARDS.iter().map(|&board| against_budgets(board, &budgets)).collect();
    let codec = Image::read(&codec)?.flash;
    results.push(budgets.codec_t7.compare("codec, one T7 command streaming, host side", codec));
    results.into_iter().collect()
}

/// Prints the sizes of the default board's images; fails when one is over its budget.
pub fn check() -> Outcome {
    let budgets = Budgets::read()?;
    header();
    against_budgets(boards::DEFAULT, &budgets)
}

/// Prints what an image takes.
pub fn print(what: &str, elf: &Path) -> Outcome {
    let Image { flash, ram, .. } = Image::read(elf)?;
    println!("{what}: {flash} bytes of flash, {ram} bytes of static RAM");
    Ok(())
}

fn header() {
    println!("\n{:<54}{:>10}{:>10}{:>10}", "against its budget, bytes", "is", "most", "goal");
}

fn against_budgets(board: Board, budgets: &Budgets) -> Outcome {
    let [all, modbus_storage, t7_modbus, shipped] = MEASURED.map(|variant| variant.on(board).elf());
    let all = Image::read(&all)?;
    let flash = |elf: PathBuf| Image::read(&elf).map(|image| image.flash);
    let name = board.name;
    println!("{:<54}{:>10}", format!("{name}: everything, with its log"), flash(shipped)?);
    let results = [
        budgets.flash.compare(&format!("{name}: everything"), all.flash),
        budgets
            .flash_modbus_storage
            .compare(&format!("{name}: Modbus with storage, no commissioning"), flash(modbus_storage)?),
        budgets.flash_t7_modbus.compare(&format!("{name}: T7s with Modbus, no storage"), flash(t7_modbus)?),
        budgets.static_ram.compare(&format!("{name}: static RAM, everything"), all.ram),
    ];
    results.into_iter().collect()
}

/// Prints how much code each part has in the whole image, and how much less flash the image takes without it.
fn parts() -> Outcome {
    let all = Image::read(&WITHOUT_LOG.elf())?;
    println!("\n{:<24}{:>10}{:>16}{:>16}", "part, bytes", "own code", "goes with it", "RAM with it");
    for Part { name, crates, with_and_without } in &ALL_PARTS {
        let own: u64 = crates.iter().map(|part| all.code_of(part)).sum();
        let own = if crates.is_empty() { String::from("-") } else { own.to_string() };
        let (flash, ram) = match with_and_without {
            Some((with, without)) => {
                let (with, without) = (Image::read(&with.elf())?, Image::read(&without.elf())?);
                let less = |with: u64, without: u64| with.saturating_sub(without).to_string();
                (less(with.flash, without.flash), less(with.ram, without.ram))
            }
            None => (String::from("-"), String::from("-")),
        };
        println!("{name:<24}{own:>10}{flash:>16}{ram:>16}");
    }
    let code: u64 = all.code.values().sum();
    println!("{:<24}{code:>10}", "all code");
    println!("{:<24}{:>10}", "constants, vectors", all.flash.saturating_sub(code));
    Ok(())
}

/// The program that does one T7 command with the codec and nothing else.
fn build_codec(steps: &mut Steps) -> Result<PathBuf, Failure> {
    let target_dir = command::target_dir().join("codec-size");
    let mut build = command::cargo(["build", "--release", "--locked", "--target", TARGET]);
    build.current_dir(command::root().join("crates/codec/size"));
    // The workspace's linker arguments are for the firmware.
    build.env("RUSTFLAGS", "-C link-arg=--nmagic").env("CARGO_TARGET_DIR", &target_dir);
    steps.need("codec", build)?;
    Ok(target_dir.join(TARGET).join("release/clino-codec-size"))
}

#[cfg(test)]
mod tests {
    use super::image::PARTS;
    use super::*;

    #[test]
    fn every_part_of_an_image_is_in_one_row_of_the_table() {
        for part in PARTS.into_iter().chain([OTHER]) {
            let rows = ALL_PARTS.iter().filter(|row| row.crates.contains(&part)).count();
            assert_eq!(rows, 1, "{part}");
        }
    }

    #[test]
    fn a_budget_that_is_exceeded_is_a_failure() {
        let budget = Budget { most: 10, goal: 5 };
        assert!(budget.compare("met", 5).is_ok() && budget.compare("missed", 10).is_ok());
        assert!(budget.compare("over", 11).is_err());
    }
}
