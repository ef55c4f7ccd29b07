//! `clino completions` and `clino man`: made from the description of the arguments, so that they cannot disagree with it.

use std::io::{self, Write as _};
use std::path::PathBuf;

use clap::{Args, Command};
use clap_complete::Shell;

use crate::outcome::{DecodeVerdict, Failure};

/// Name of the program.
const NAME: &str = "clino";

/// `clino completions`
#[derive(Args)]
pub struct Completions {
    /// bash, zsh, fish, elvish or powershell
    #[arg(value_name = "SHELL")]
    shell: Shell,
}

/// `clino man`
#[derive(Args)]
pub struct Manual {
    /// Write a page for each command into this folder
    #[arg(long, value_name = "FOLDER")]
    dir: Option<PathBuf>,
}

/// Prints the completions of a shell for this program.
pub fn completions(arguments: &Completions, mut program: Command) -> Result<DecodeVerdict, Failure> {
    let mut text = Vec::new();
    clap_complete::generate(arguments.shell, &mut program, NAME, &mut text);
    io::stdout().write_all(&text)?;
    Ok(DecodeVerdict::Good)
}

/// Prints the manual page, or writes those of all commands.
pub fn manual(arguments: &Manual, program: Command) -> Result<DecodeVerdict, Failure> {
    match &arguments.dir {
        Some(folder) => {
            std::fs::create_dir_all(folder)?;
            clap_mangen::generate_to(program, folder)?;
        }
        None => {
            let mut text = Vec::new();
            clap_mangen::Man::new(program).render(&mut text)?;
            io::stdout().write_all(&text)?;
        }
    }
    Ok(DecodeVerdict::Good)
}
