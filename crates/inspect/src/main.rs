//! `inspect stack TABLE ELF`

use std::env;
use std::fs;
use std::process::ExitCode;

use clino_inspect::annotations::Annotations;
use clino_inspect::elf::Image;
use clino_inspect::{Error, calls, cfi, frames, instruction, stack};

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let result = match arguments[..] {
        ["stack", table, elf] => check_stack(table, elf),
        _ => {
            eprintln!("Usage: inspect stack TABLE ELF");
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

fn check_stack(table: &str, elf: &str) -> Result<(), Error> {
    let annotations = Annotations::parse(&fs::read_to_string(table)?)?;
    let elf = fs::read(elf)?;
    let image = Image::parse(&elf)?;
    let code = instruction::decode(&image)?;
    let frames = frames::all(&image, &code)?;
    let (notes, functions) = cfi::compare(&elf, &image, &frames)?;
    println!("{} functions; {notes} notes of the compiler on {functions} of them agree", frames.len());
    let graph = calls::graph(&image, &code, &frames, &annotations)?;
    let levels = stack::worst(&image, &frames, &graph, &annotations)?;
    for level in &levels {
        println!("{}: {} bytes, {} of them by the core", level.name, level.bytes(), level.exception_frame);
        for link in &level.chain {
            println!("  {:>5}  {}", link.bytes, image.name_of(link.function));
        }
    }
    let total = stack::total(&levels);
    let (limit, goal) = (annotations.limit_bytes, annotations.goal_bytes);
    let met = if total > goal { "MISSED" } else { "met" };
    println!("worst-case stack: {total} bytes (limit {limit}; goal {goal}: {met})");
    if total > limit {
        return Err(Error::new("the stack is over its limit"));
    }
    Ok(())
}
