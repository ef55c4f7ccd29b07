//! Runs a firmware image on the virtual board with a scenario around it.
//!
//! Prints the gateway's console as it comes, then a summary; or serves the console and the Modbus port on
//! pseudo-terminals, in real time. Exit status: 0 if everything worked, 1 if it ran but something is wrong, 2 for a
//! wrong command line, scenario or image.

mod arguments;
mod pace;
#[cfg(target_os = "linux")]
mod serve;
mod stored;

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Instant;

use arguments::{Arguments, Duration, USAGE};
use clino_board::elf::{ElfError, Image};
use clino_board::run::{Extras, Run};
use clino_board::scenario::Scenario;
use clino_sim::node::Ns;
use pace::Pace;

const HOW_TO_BUILD: &str = "`cargo xtask sim` builds and runs the image; to build it only:
  cargo build --release --package clino-firmware --target thumbv7em-none-eabihf";

const DEFAULT_SCENARIO: &str = include_str!("../../../../../scenarios/default.toml");
const DEFAULT_SCENARIO_NAME: &str = "scenarios/default.toml";

const NOT_WELL: u8 = 1;
const BAD_INPUT: u8 = 2;

/// In real time, virtual time goes on by this much at once.
const STEP: Ns = 1_000_000;
/// A run without an end keeps the log of this much virtual time, unless the log or the levels are wanted.
const REMEMBERED: Ns = 600_000_000_000;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if arguments.iter().any(|argument| argument == "--help" || argument == "-h") {
        println!("{USAGE}");
        return ExitCode::SUCCESS;
    }
    let wanted = Arguments::parse(&arguments).map_err(|why| format!("{why}\n\n{USAGE}"));
    match wanted.and_then(|wanted| run(&wanted)) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(NOT_WELL),
        Err(why) => {
            eprintln!("error: {why}");
            ExitCode::from(BAD_INPUT)
        }
    }
}

/// Runs what was asked for; returns whether all is well.
fn run(wanted: &Arguments) -> Result<bool, String> {
    let scenario = match &wanted.scenario {
        Some(path) => Scenario::read(path),
        None => Scenario::parse(Path::new(DEFAULT_SCENARIO_NAME), DEFAULT_SCENARIO),
    };
    let scenario = scenario.map_err(|why| why.to_string())?;
    let image = Image::read(&wanted.elf, wanted.board).map_err(|why| image_complaint(&wanted.elf, &why))?;
    let image = match &wanted.flash {
        Some(path) => stored::put_into(image, path)?,
        None => image,
    };
    let bus_log = wanted.bus_log.as_deref().map(create).transpose()?;
    let vcd = wanted.vcd.as_deref().map(create).transpose()?;
    let mut log = Log(wanted.rtt.as_deref().map(create).transpose()?);
    let extras = Extras { levels: vcd.is_some(), adapters: wanted.bus_ptys };
    let mut run = Run::with(&image, &scenario, extras).map_err(|why| why.to_string())?;
    if let Some(step) = wanted.cut_power {
        run.board().cut_power_at(step, step);
    }
    match wanted.duration {
        Duration::Of(duration) => run.set_duration(duration),
        _ if wanted.forever() => {
            run.set_duration(Ns::MAX);
            if bus_log.is_none() && vcd.is_none() {
                run.remember(REMEMBERED);
            }
        }
        _ => {}
    }

    let interrupted = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&interrupted);
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed)).map_err(|why| why.to_string())?;

    let begun = Instant::now();
    if wanted.realtime {
        in_real_time(&mut run, wanted, &mut log, &interrupted).map_err(|why| why.to_string())?;
    } else {
        at_full_speed(&mut run, &mut log, &interrupted).map_err(|why| why.to_string())?;
    }
    if interrupted.load(Ordering::Relaxed) {
        eprintln!("interrupted");
    }
    if let Some(path) = &wanted.flash {
        stored::keep(run.board(), path)?;
    }
    let (summary, well) = run.summary();
    // If the output was closed, the exit status still reports the result.
    let _ = write!(io::stdout(), "{summary}");
    // What depends on this machine stays out of the output that is the same for the same scenario.
    eprintln!("took {:.1} s", begun.elapsed().as_secs_f64());
    if let (Some(path), Some(file)) = (&wanted.bus_log, bus_log) {
        let mut file = BufWriter::new(file);
        let written = run.write_bus_log(&mut file).and_then(|()| file.flush());
        written.map_err(|why| format!("{}: {why}", path.display()))?;
    }
    if let (Some(path), Some(file)) = (&wanted.vcd, vcd) {
        run.write_vcd(file).map_err(|why| format!("{}: {why}", path.display()))?;
    }
    Ok(well)
}

/// Runs to the end, until it is interrupted or the reader of the console closes it.
fn at_full_speed(run: &mut Run, log: &mut Log, interrupted: &AtomicBool) -> io::Result<()> {
    let mut out = io::stdout();
    let mut printed = Ok(());
    while !interrupted.load(Ordering::Relaxed) && printed.is_ok() {
        let more = run.go_on(|line| {
            if printed.is_ok() {
                printed = writeln!(out, "{}", line.text);
            }
        });
        log.take(run)?;
        if !more {
            break;
        }
    }
    Ok(())
}

/// Likewise, no faster than the wall clock, with the ports served that are wanted.
fn in_real_time(
    run: &mut Run,
    wanted: &Arguments,
    log: &mut Log,
    interrupted: &AtomicBool,
) -> io::Result<()> {
    let mut out = io::stdout();
    let mut ports = open_ports(run, wanted, &mut out)?;
    let mut pace = Pace::default();
    let begun = Instant::now();
    let mut printed = Ok(());
    while !interrupted.load(Ordering::Relaxed) && printed.is_ok() {
        let now = run.board().now();
        ports.bring(now)?;
        let more = run.go_on_by(STEP, |line| {
            if printed.is_ok() && !wanted.console_pty {
                printed = writeln!(out, "{}", line.text);
            }
        });
        ports.fetch()?;
        log.take(run)?;
        if !more {
            break;
        }
        thread::sleep(pace.wait(run.now(), begun.elapsed()));
        if let Some(pace::Complaint { at, lost }) = pace.complaint(begun.elapsed()) {
            let (at, lost) = (at.as_secs_f64(), lost.as_secs_f64());
            let reached = (at - lost) / at * 100.0;
            eprintln!("slower than real time: {lost:.1} s lost in the last {at:.1} s ({reached:.0} %)");
        }
    }
    eprintln!("{:.3} s behind the wall clock", pace.lost().as_secs_f64());
    Ok(())
}

/// Where the image's log goes, if it is wanted: as it comes, so that another program may follow it.
struct Log(Option<File>);

impl Log {
    fn take(&mut self, run: &mut Run) -> io::Result<()> {
        match &mut self.0 {
            Some(file) => file.write_all(&run.board().take_rtt()),
            None => Ok(()),
        }
    }
}

#[cfg(target_os = "linux")]
fn open_ports(run: &mut Run, wanted: &Arguments, out: &mut impl Write) -> io::Result<serve::Ports> {
    if wanted.has_ptys() {
        run.attend();
    }
    serve::Ports::open(run, wanted, out)
}

#[cfg(not(target_os = "linux"))]
fn open_ports(_run: &mut Run, wanted: &Arguments, _out: &mut impl Write) -> io::Result<NoPorts> {
    if wanted.has_ptys() {
        return Err(io::Error::other("pseudo-terminals need Linux"));
    }
    Ok(NoPorts)
}

/// Nothing is served on this system.
#[cfg(not(target_os = "linux"))]
struct NoPorts;

#[cfg(not(target_os = "linux"))]
impl NoPorts {
    fn bring(&mut self, _now: Ns) -> io::Result<()> {
        Ok(())
    }

    fn fetch(&mut self) -> io::Result<()> {
        Ok(())
    }
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
