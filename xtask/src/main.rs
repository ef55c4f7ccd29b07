//! `cargo xtask …`: the front door to everything that plain cargo cannot do.

mod boards;
mod book;
mod campaign;
mod check;
mod circles;
mod command;
mod firmware;
mod flash;
mod hex;
mod hil;
mod lint;
mod nextest;
mod pictures;
mod programs;
mod sim;
mod size;
mod steps;
mod test;
mod transcripts;
mod witness;

use std::env;
use std::process::ExitCode;

use command::{Failure, Outcome};

const USAGE: &str = "\
Usage: cargo xtask <command>

  sim [--board NAME] [--duration 5s] [--scenario FILE] [--bus-log FILE] [--realtime]
      [--console-pty] [--modbus-pty]
             build the firmware and run it on the virtual board; `sim --help` says more
  test [--quick]
             every test: portable, firmware build, firmware on the virtual board;
             --quick: the portable ones, and a handful on the firmware image.
             With `cargo nextest` where it is installed; CLINO_TEST_RUNNER=cargo does without it
  lint       formatting, clippy for host and target, documentation, the book if mdbook is installed
  check [NAME ...]
             figures of the reusable crates: panics, instructions, coverage, fuzzing, ...
  campaign [NAME ...]
             long runs of what the tests show in short; without a name it lists them, and says
             how to add one
  circles    whether source files of a crate depend on each other in a circle
  book       the documents as a book, below target/book, with mdBook
  transcripts
             write the console transcripts of the documents anew, from runs of the firmware image,
             and what docs/fleet.md shows of the bridge
  pictures   draw the pictures of docs/bring-up.md anew, from captures of the virtual board, and take
             those of docs/fleet.md with a browser
  size [--against REV]
             flash and RAM of the firmware images for both boards, against their budgets, and of
             each part; --against: how much each part has grown since a revision
  features   build the firmware with every combination of parts that makes sense
  witness [qemu]
             the image on a second, independent emulator, which it installs if it is missing (a quarter
             of an hour), and the comparison of the two cores; or the image on QEMU, answers only
  flash [--board NAME]
             put the firmware on a real board (needs probe-rs)
  image [--board NAME]
             write the firmware as a .hex file, for the drive that a Nucleo's ST-LINK shows
  hil [--board NAME] --virtual | --console PORT [...]
             the image on a board with this computer at its ports: assertions, times, a report;
             or on the virtual board. `hil --help` says more; docs/bring-up.md how to wire it

Boards: f407-disc1 (STM32F407G-DISC1, the default), f407ve (black boards with an STM32F407VE),
nucleo-f446re (NUCLEO-F446RE).

Exit status: 0 it worked, 1 it did not, 2 the command line, a scenario or an image is wrong.
";

/// Exit status when the command line is wrong.
const BAD_USAGE: u8 = 2;

fn main() -> ExitCode {
    let mut arguments = env::args().skip(1);
    let command = arguments.next();
    let rest: Vec<String> = arguments.collect();
    let result = match command.as_deref() {
        Some(command @ ("sim" | "hil" | "flash" | "image")) => for_board(command, &rest),
        Some("test") if rest.is_empty() => test::run(),
        Some("test") if rest == ["--quick"] => test::quick(),
        Some("check") => check::run(&rest),
        Some("campaign") => campaign::run(&rest),
        Some("lint") if rest.is_empty() => lint::run(),
        Some("circles") if rest.is_empty() => circles::run(),
        Some("size") => size::run(&rest),
        Some("features") if rest.is_empty() => firmware::features(),
        Some("book") if rest.is_empty() => book::run(),
        Some("transcripts") if rest.is_empty() => transcripts::run(),
        Some("witness") if rest.is_empty() => witness::run(),
        Some("witness") if rest == ["qemu"] => witness::qemu(),
        Some("pictures") if rest.is_empty() => pictures::run(),
        Some("help" | "--help" | "-h") => {
            print!("{USAGE}");
            return ExitCode::SUCCESS;
        }
        _ => {
            eprint!("{USAGE}");
            return ExitCode::from(BAD_USAGE);
        }
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("cargo xtask: {failure}");
            ExitCode::from(failure.status)
        }
    }
}

/// The commands that are about one board.
fn for_board(command: &str, arguments: &[String]) -> Outcome {
    let (board, rest) = boards::take(arguments)?;
    match command {
        "sim" => sim::run(board, &rest),
        "hil" => hil::run(board, &rest),
        _ if !rest.is_empty() => {
            let message = format!("{command} takes no `{}`\n\n{USAGE}", rest.join(" "));
            Err(Failure { message, status: BAD_USAGE })
        }
        "flash" => flash::run(board),
        _ => hex::run(board),
    }
}
