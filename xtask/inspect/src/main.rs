//! `inspect stack TABLE BUDGETS ELF`: the worst-case stack of an image, against its budget. `inspect panics LIST ELF`: the panics left in it.

use std::env;
use std::fs;
use std::process::ExitCode;

use clino_inspect::annotations::Annotations;
use clino_inspect::budget::{Budget, Budgets};
use clino_inspect::elf::Image;
use clino_inspect::report::Report;
use clino_inspect::source::Lines;
use clino_inspect::{Error, frames, instruction, panics, stack};

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let result = match arguments[..] {
        ["stack", table, budgets, elf] => check_stack(table, budgets, elf),
        ["panics", list, elf] => check_panics(list, elf),
        _ => {
            eprintln!("Usage: inspect stack TABLE BUDGETS ELF\n       inspect panics LIST ELF");
            return ExitCode::from(2);
        }
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("inspect: {error}");
            ExitCode::FAILURE
        }
    }
}

fn check_stack(table: &str, budgets: &str, elf: &str) -> Result<(), Error> {
    let Budget { most, goal } = Budgets::parse(&fs::read_to_string(budgets)?)?.stack;
    let annotations = Annotations::parse(&fs::read_to_string(table)?)?;
    let Report { image, functions, agreeing, levels } = Report::of(&fs::read(elf)?, &annotations)?;
    println!("{functions} functions; {agreeing} notes of the compiler agree");
    for level in &levels {
        println!("{}: {} bytes, {} of them by the core", level.name, level.bytes(), level.exception_frame);
        for link in &level.chain {
            println!("  {:>5}  {}", link.bytes, image.name_of(link.function));
        }
    }
    let total = stack::total(&levels);
    let met = if total > goal { "MISSED" } else { "met" };
    println!("worst-case stack: {total} bytes (limit {most}; goal {goal}: {met})");
    if total > most {
        return Err(Error::new("the stack is over its limit"));
    }
    Ok(())
}

fn check_panics(list: &str, elf: &str) -> Result<(), Error> {
    let listed = panics::listed(&fs::read_to_string(list)?)?;
    let elf = fs::read(elf)?;
    let image = Image::parse(&elf)?;
    let frames = frames::all(&image, &instruction::decode(&image)?)?;
    let found = panics::find(&image, &frames, &Lines::parse(&elf)?)?;
    let differences = panics::compare(&found, &listed);
    let sites: usize = found.values().map(Vec::len).sum();
    println!("panics: {sites} sites in {} files", found.len());
    if differences.is_empty() { Ok(()) } else { Err(Error::new(differences.join("\n"))) }
}
