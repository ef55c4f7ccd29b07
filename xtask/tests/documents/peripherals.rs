//! Which file of the firmware names which pins and peripherals.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use crate::page::{root, settle};

/// Peripherals as the register crate names them; with a star, those that begin like this and end with digits.
const PERIPHERALS: [&str; 12] =
    ["USART*", "TIM*", "EXTI*", "GPIO*", "RCC", "FLASH", "IWDG", "DBGMCU", "DWT", "NVIC", "SCB", "SYST"];

/// The sources of the firmware.
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("src") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|is| is == "rs") {
            found.push(path);
        }
    }
    found.sort();
}

/// The words of the code, comments left out.
fn words(source: &str) -> BTreeSet<String> {
    let code = source.lines().map(|line| line.split("//").next().unwrap_or(""));
    let words = code.flat_map(|line| line.split(|it: char| !it.is_alphanumeric() && it != '_'));
    words.filter(|word| !word.is_empty()).map(str::to_owned).collect()
}

/// `PA15` is one, and `pa15`.
fn is_pin(word: &str) -> bool {
    let mut letters = word.chars();
    let (p, port) = (letters.next(), letters.next());
    let number = letters.as_str();
    matches!((p, port), (Some('P'), Some('A'..='I')) | (Some('p'), Some('a'..='i')))
        && !number.is_empty()
        && number.parse::<u8>().is_ok_and(|number| number < 16)
}

fn is_peripheral(word: &str) -> bool {
    PERIPHERALS.iter().any(|name| match name.strip_suffix('*') {
        Some("GPIO") => word.len() == 5 && word.starts_with("GPIO"),
        Some(begin) => word.strip_prefix(begin).is_some_and(|number| number.parse::<u8>().is_ok()),
        None => word == *name,
    })
}

/// Whether the file is about the board: `src/board.rs`, or one of those below it.
fn is_about_board(path: &Path) -> bool {
    path.ends_with("src/board.rs") || path.parent().is_some_and(|folder| folder.ends_with("src/board"))
}

#[test]
fn pins_are_named_in_the_boards_file() {
    let mut files = Vec::new();
    sources(&root().join("src"), &mut files);
    for path in files {
        let pins: Vec<String> = words(&fs::read_to_string(&path).expect("a source"))
            .into_iter()
            .filter(|word| is_pin(word))
            .collect();
        assert!(is_about_board(&path) || pins.is_empty(), "{}: {pins:?}", path.display());
    }
}

#[test]
fn the_table_of_peripherals_is_true_and_has_the_boards_files() {
    let mut files = Vec::new();
    sources(&root().join("src"), &mut files);
    let mut table = String::from("| file | peripherals and interrupts that it names |\n|---|---|\n");
    for path in files {
        let words = words(&fs::read_to_string(&path).expect("a source"));
        let named: Vec<String> = words.into_iter().filter(|word| is_peripheral(word)).collect();
        if !named.is_empty() {
            let path = path.strip_prefix(root()).expect("below the root");
            let may = is_about_board(path) || path.ends_with("src/main.rs");
            assert!(may, "{} names {}", path.display(), named.join(", "));
            writeln!(table, "| `{}` | {} |", path.display(), named.join(", ")).expect("a string");
        }
    }
    settle("architecture.md", "peripherals", &table);
}
