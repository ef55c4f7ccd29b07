//! Runs a firmware image on the virtual board with a scenario around it.
//!
//! Prints the gateway's console as it comes, then a summary. Exit status: 0 if everything worked, 1 if it ran but
//! something is wrong, 2 for a wrong command line, scenario or image.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use clino_board::elf::{ElfError, Image};
use clino_board::run::Run;
use clino_board::scenario::{Scenario, Time};

const USAGE: &str = "\
usage: vboard --elf FILE [--scenario FILE] [--duration TIME] [--bus-log FILE]

  --elf FILE       firmware image to run
  --scenario FILE  sensors and what befalls them (docs/scenario.md); default: scenarios/default.toml
  --duration TIME  virtual time to run, such as 5s or 200ms; default: the scenario's
  --bus-log FILE   write every character and every DE edge on both RS485 buses to FILE
  --help           this text

exit status: 0 all well, 1 ran but something is wrong, 2 wrong command line, scenario or image";

const HOW_TO_BUILD: &str = "`cargo xtask sim` builds and runs the image; to build it only:
  cargo build --release --package clino-firmware --target thumbv7em-none-eabihf";

const DEFAULT_SCENARIO: &str = include_str!("../../../../scenarios/default.toml");
const DEFAULT_SCENARIO_NAME: &str = "scenarios/default.toml";

const NOT_WELL: u8 = 1;
const BAD_INPUT: u8 = 2;

/// What the command line asks for.
#[derive(Default)]
struct Wanted {
    elf: PathBuf,
    scenario: Option<PathBuf>,
    duration: Option<Time>,
    bus_log: Option<PathBuf>,
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if arguments.iter().any(|argument| argument == "--help" || argument == "-h") {
        println!("{USAGE}");
        return ExitCode::SUCCESS;
    }
    match parse(&arguments).map_err(|why| format!("{why}\n\n{USAGE}")).and_then(|wanted| run(&wanted)) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(NOT_WELL),
        Err(why) => {
            eprintln!("error: {why}");
            ExitCode::from(BAD_INPUT)
        }
    }
}

fn parse(arguments: &[String]) -> Result<Wanted, String> {
    let mut wanted = Wanted::default();
    let mut rest = arguments.iter();
    while let Some(flag) = rest.next() {
        let mut value = || rest.next().ok_or_else(|| format!("{flag} needs a value"));
        match flag.as_str() {
            "--elf" => wanted.elf = value()?.into(),
            "--scenario" => wanted.scenario = Some(value()?.into()),
            "--duration" => {
                let time: Time = value()?.parse().map_err(|why| format!("{flag}: {why}"))?;
                if time.0 == 0 {
                    return Err(format!("{flag}: 0 s, expected more than that"));
                }
                wanted.duration = Some(time);
            }
            "--bus-log" => wanted.bus_log = Some(value()?.into()),
            other => return Err(format!("unknown argument `{other}`")),
        }
    }
    if wanted.elf.as_os_str().is_empty() { Err("--elf FILE is missing".into()) } else { Ok(wanted) }
}

/// Runs what was asked for; returns whether all is well.
fn run(wanted: &Wanted) -> Result<bool, String> {
    let scenario = match &wanted.scenario {
        Some(path) => Scenario::read(path),
        None => Scenario::parse(Path::new(DEFAULT_SCENARIO_NAME), DEFAULT_SCENARIO),
    };
    let scenario = scenario.map_err(|why| why.to_string())?;
    let image = Image::read(&wanted.elf).map_err(|why| image_complaint(&wanted.elf, &why))?;
    let bus_log = wanted.bus_log.as_deref().map(create).transpose()?;
    let mut run = Run::new(&image, &scenario).map_err(|why| why.to_string())?;
    if let Some(Time(duration)) = wanted.duration {
        run.set_duration(duration);
    }

    let interrupted = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&interrupted);
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed)).map_err(|why| why.to_string())?;

    let begun = Instant::now();
    let mut out = io::stdout();
    let mut printed = Ok(());
    while !interrupted.load(Ordering::Relaxed) && printed.is_ok() {
        let more = run.go_on(|line| {
            if printed.is_ok() {
                printed = writeln!(out, "{}", line.text);
            }
        });
        if !more {
            break;
        }
    }
    if interrupted.load(Ordering::Relaxed) {
        eprintln!("interrupted");
    }
    let (summary, well) = run.summary();
    // Nobody reads on if the output was closed; the exit status still tells.
    let _ = write!(out, "{summary}");
    // What depends on this machine stays out of the output that is the same for the same scenario.
    eprintln!("took {:.1} s", begun.elapsed().as_secs_f64());
    if let (Some(path), Some(file)) = (&wanted.bus_log, bus_log) {
        let mut file = BufWriter::new(file);
        let written = run.write_bus_log(&mut file).and_then(|()| file.flush());
        written.map_err(|why| format!("{}: {why}", path.display()))?;
    }
    Ok(well)
}

fn create(path: &Path) -> Result<File, String> {
    File::create(path)
        .map_err(|why| format!("{}: {why}, expected a file that can be written", path.display()))
}

fn image_complaint(path: &Path, why: &ElfError) -> String {
    match why {
        ElfError::Missing(_) | ElfError::Unreadable(..) => format!("{why}\n{HOW_TO_BUILD}"),
        _ => format!("{}: {why}\n{HOW_TO_BUILD}", path.display()),
    }
}
