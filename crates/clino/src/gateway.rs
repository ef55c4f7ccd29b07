//! `clino gateway backup|restore`: the configuration of a gateway as text, through its console, and back.
//!
//! The text is what `export` prints: the commands that make the configuration. `restore` compares it with what the gateway has,
//! carries out the parts that differ (a bus, the Modbus port, the console, a slot), compares again, and saves.

mod console;
mod parts;

use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};

use crate::bus::Stop;
use crate::outcome::{DecodeVerdict, Failure};
use crate::port::{self, PortName};
use crate::say::{Item, Say};
use crate::session::{Consent, port_failed};
use console::{Broken, Console};
use parts::{Part, parts};

/// Bit rate of the console. Source: docs/console.md.
const BAUD: u32 = 115_200;

/// What can be done with a gateway.
#[derive(Subcommand)]
pub enum Tool {
    /// The configuration as text: the commands that make it
    Backup(Backup),
    /// Make the configuration of a backup; writes only what differs, compares, and saves
    Restore(Restore),
}

/// The console of the gateway.
#[derive(Args)]
pub struct ConsoleOptions {
    /// Port of the gateway's console: a serial port, a pseudo-terminal, or tcp://host:port
    #[arg(long, value_name = "PORT")]
    port: PortName,
    /// One JSON object per line
    #[arg(long)]
    json: bool,
}

/// `clino gateway backup`
#[derive(Args)]
pub struct Backup {
    /// Write it to this file, whole or not at all; standard output if none is named
    #[arg(value_name = "FILE")]
    file: Option<PathBuf>,
    #[command(flatten)]
    console: ConsoleOptions,
}

/// `clino gateway restore`
#[derive(Args)]
pub struct Restore {
    /// A backup; - is standard input
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Do not save: a restart brings back what was saved before
    #[arg(long)]
    no_save: bool,
    #[command(flatten)]
    console: ConsoleOptions,
    #[command(flatten)]
    consent: Consent,
}

/// Carries out a command.
pub fn run(tool: Tool) -> Result<DecodeVerdict, Failure> {
    match tool {
        Tool::Backup(backup) => self::backup(&backup),
        Tool::Restore(restore) => self::restore(&restore),
    }
}

fn backup(Backup { file, console: options }: &Backup) -> Result<DecodeVerdict, Failure> {
    let mut say = Say::new(options.json);
    let lines = on_console(&mut say, options, |console| console.export())?;
    let text: String = lines.iter().map(|line| format!("{line}\n")).collect();
    match file {
        None if options.json => {
            for line in &lines {
                say.line("export", &[("line", Item::Text(line.clone()))])?;
            }
        }
        None => say.print(&text)?,
        Some(path) => {
            write_whole(path, &text)
                .map_err(|error| io::Error::new(error.kind(), format!("{}: {error}", path.display())))?;
            let name = Item::Text(path.display().to_string());
            let count = i64::try_from(lines.len()).unwrap_or(i64::MAX);
            say.line("backup", &[("file", name), ("lines", Item::Number(count))])?;
        }
    }
    Ok(DecodeVerdict::Good)
}

fn restore(arguments: &Restore) -> Result<DecodeVerdict, Failure> {
    let Restore { file, no_save, console: options, consent } = arguments;
    let mut say = Say::new(options.json);
    consent.refuse_programs(&mut say)?;
    let text =
        read(file).map_err(|error| io::Error::new(error.kind(), format!("{}: {error}", file.display())))?;
    let wanted = parts(text.lines()).map_err(Failure::Usage)?;
    if wanted.is_empty() {
        return Err(Failure::Usage(format!("{}: it has no line of a backup", file.display())));
    }
    let stop = Stop::on_signals()?;
    let present = on_console(&mut say, options, |console| console.export())?;
    let present = parts(present.iter().map(String::as_str)).map_err(Failure::Usage)?;
    let differ: Vec<&Part> = wanted.iter().filter(|part| !present.contains(part)).collect();
    if differ.is_empty() {
        say.line("unchanged", &[("writes", Item::Number(0))])?;
        return Ok(DecodeVerdict::Good);
    }
    let old = |part: &Part| present.iter().find(|present| present.target == part.target);
    let names: Vec<&str> = differ.iter().map(|part| part.target.as_str()).collect();
    let question = format!(
        "this changes the gateway: {}{}",
        names.join(", "),
        if *no_save { "" } else { ", and saves" }
    );
    if !consent.yes && !say.ask(&question, &stop)? {
        say.note("nothing was written")?;
        return Err(Failure::STOPPED);
    }
    // Each part whole, or not at all: a gateway that is stopped between two has both valid.
    let written = on_console(&mut say, options, |console| {
        let mut written = Vec::new();
        for part in &differ {
            if stop.is_asked() {
                return Ok((written, None));
            }
            for line in &part.lines {
                if let Some(error) = console.command(line)? {
                    return Ok((written, Some((line.clone(), error))));
                }
            }
            written.push(part.target.clone());
        }
        Ok((written, None))
    })?;
    let (written, refused) = written;
    for part in differ.iter().filter(|part| written.contains(&part.target)) {
        let joined = |part: Option<&Part>| part.map_or(Item::None, |part| Item::Text(part.lines.join("; ")));
        let values = [
            ("target", Item::Text(part.target.clone())),
            ("to", joined(Some(part))),
            ("from", joined(old(part))),
        ];
        say.line("changed", &values)?;
    }
    if let Some((line, error)) = refused {
        say.failure(
            "refused",
            &format!("the gateway refuses '{line}': {error}"),
            "the parts above are changed, and not saved",
        )?;
        return Ok(DecodeVerdict::Bad);
    }
    if written.len() < differ.len() {
        say.hint("stopped", "stopped between two parts; nothing was saved")?;
        return Err(Failure::STOPPED);
    }
    let now = on_console(&mut say, options, |console| console.export())?;
    let now = parts(now.iter().map(String::as_str)).map_err(Failure::Usage)?;
    if let Some(part) = wanted.iter().find(|part| !now.contains(part)) {
        let why = format!("{} is not what was written", part.target);
        say.failure("not_verified", &why, "repeat the command; it writes only what differs")?;
        return Ok(DecodeVerdict::Bad);
    }
    let saved = !no_save;
    if saved && let Some(error) = on_console(&mut say, options, |console| console.command("save --yes"))? {
        say.failure("not_saved", &format!("the gateway does not save: {error}"), "type save at its console")?;
        return Ok(DecodeVerdict::Bad);
    }
    let count = i64::try_from(written.len()).unwrap_or(i64::MAX);
    say.line("restored", &[("parts", Item::Number(count)), ("saved", Item::Flag(saved))])?;
    Ok(DecodeVerdict::Good)
}

/// Does it at the console; what is wrong with port or console is told.
fn on_console<T>(
    say: &mut Say,
    options: &ConsoleOptions,
    act: impl FnOnce(&mut Console) -> Result<T, Broken>,
) -> Result<T, Failure> {
    let opened = port::open(&options.port, BAUD, port::Wiring::default()).map_err(Broken::Port);
    let done = opened.and_then(|port| {
        let mut console = Console::begin(port)?;
        let done = act(&mut console);
        console.end()?;
        done
    });
    match done {
        Ok(done) => Ok(done),
        Err(Broken::Port(error)) => Err(port_failed(say, &error)?),
        Err(Broken::Silent) => {
            let next =
                "check that this is the console's port, 115200 bit/s, and that no other program uses it";
            say.failure("no_console", "no gateway answers", next)?;
            Err(Failure::Reported(1))
        }
    }
}

/// Beside it first, then in its place.
fn write_whole(path: &Path, text: &str) -> io::Result<()> {
    let mut beside = path.as_os_str().to_owned();
    beside.push(".new");
    let beside = PathBuf::from(beside);
    let mut file = std::fs::File::create(&beside)?;
    io::Write::write_all(&mut file, text.as_bytes())?;
    file.sync_all()?;
    std::fs::rename(&beside, path)
}

fn read(path: &Path) -> io::Result<String> {
    if path != Path::new("-") {
        return std::fs::read_to_string(path);
    }
    let mut text = String::new();
    io::stdin().lock().read_to_string(&mut text)?;
    Ok(text)
}
