//! The steps of a command: programs that run one after the other or side by side, and a table of what each took.
//!
//! A step that others depend on ends the command when it fails ([`Steps::need`]). Any other failure is kept: the
//! rest runs, and the command fails at its end with the names of all failed steps.
//!
//! Steps that run side by side write to files below `target/steps`; each file is printed as a whole when its step has
//! ended.

mod process;
mod table;

use std::fs::{self, File};
use std::path::PathBuf;
use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

use crate::command::{self, Failure, Outcome};
use process::Process;
use table::{Row, table};

/// How often running steps are looked at.
const LOOK: Duration = Duration::from_millis(20);

/// A step that may run beside others.
pub struct Step {
    name: String,
    command: Command,
}

impl Step {
    /// A program that keeps one core busy, and its name in the table.
    pub fn new(name: impl Into<String>, command: Command) -> Step {
        Step { name: name.into(), command }
    }
}

/// The steps so far.
pub struct Steps {
    /// The command: `cargo xtask` and this.
    command: &'static str,
    begun: Instant,
    rows: Vec<Row>,
}

/// Where what steps print is kept.
fn folder() -> PathBuf {
    command::target_dir().join("steps")
}

/// Where tests note that they did not test what they are for.
pub fn skipped() -> PathBuf {
    folder().join("skipped")
}

/// A script of the repository, which notes there what it does not check.
pub fn script(path: &str, arguments: &[&str]) -> Command {
    let mut script = command::script(path, arguments);
    script.env("CLINO_SKIPPED", skipped());
    script
}

impl Steps {
    /// Nothing has run yet.
    pub fn new(command: &'static str) -> Steps {
        // That of the last run, if there is one. The folder is there for the tests to write to.
        let _ = fs::create_dir_all(folder());
        let _ = fs::remove_file(skipped());
        Steps { command, begun: Instant::now(), rows: Vec::new() }
    }

    /// A file for what a step prints, of this name.
    pub fn file(&self, name: &str) -> PathBuf {
        let folder = folder();
        // If there is no such folder, opening the file says so.
        _ = fs::create_dir_all(&folder);
        folder.join(name.replace([' ', '/'], "-"))
    }

    /// Runs a program to its end and shows what it prints. A failure is kept for the end.
    pub fn run(&mut self, name: &str, command: Command) {
        // The failure is in the table, and in what `end` returns.
        let _ = self.need(name, command);
    }

    /// Likewise, for a step that the next ones depend on.
    pub fn need(&mut self, name: &str, command: Command) -> Outcome {
        let shown = command::shown(&command);
        eprintln!("$ {shown}");
        let begun = Instant::now();
        let ended = Process::start(command).and_then(|mut process| {
            loop {
                match process.ended()? {
                    Some(ended) => break Ok(ended),
                    None => thread::sleep(LOOK),
                }
            }
        });
        self.note(name, begun, &shown, ended)
    }

    /// Notes something that this program does itself.
    pub fn own(&mut self, name: &str, work: impl FnOnce() -> Outcome) -> Outcome {
        let begun = Instant::now();
        let outcome = work();
        let failed = outcome.is_err();
        self.rows.push(Row { name: name.to_owned(), wall: begun.elapsed(), cpu: None, failed, part: false });
        outcome
    }

    /// What the last step consisted of: how long each part took, and whether it failed.
    pub fn consisted_of(&mut self, parts: impl IntoIterator<Item = (String, Duration, bool)>) {
        let row = |(name, wall, failed)| Row { name, wall, cpu: None, failed, part: true };
        self.rows.extend(parts.into_iter().map(row));
    }

    /// Runs all of these, in this order, as many side by side as there are cores.
    pub fn side_by_side(&mut self, steps: Vec<Step>) {
        let cores = thread::available_parallelism().map_or(1, usize::from);
        let mut waiting = steps.into_iter().peekable();
        let mut running: Vec<Running> = Vec::new();
        while waiting.peek().is_some() || !running.is_empty() {
            if running.len() < cores
                && let Some(step) = waiting.next()
            {
                match Running::start(step) {
                    Ok(started) => running.push(started),
                    Err((name, failure)) => self.fail(&name, Instant::now(), failure),
                }
                continue;
            }
            let mut going = Vec::new();
            for mut step in running {
                match step.process.ended() {
                    Ok(None) => going.push(step),
                    ended => self
                        .finish(&step, ended.and_then(|ended| ended.ok_or(std::io::ErrorKind::Other.into()))),
                }
            }
            running = going;
            thread::sleep(LOOK);
        }
    }

    /// Prints the table. `planned` is what has ended the command early, if anything has.
    ///
    /// # Errors
    /// That, or the steps that failed.
    pub fn end(self, planned: Outcome) -> Outcome {
        let wall = self.begun.elapsed();
        println!("{}", table(self.command, &self.rows, wall));
        print!("{}", fs::read_to_string(skipped()).unwrap_or_default());
        planned?;
        let failed: Vec<&str> =
            self.rows.iter().filter(|row| row.failed && !row.part).map(|row| row.name.as_str()).collect();
        if failed.is_empty() {
            return Ok(());
        }
        let all = self.rows.iter().filter(|row| !row.part).count();
        let (count, names) = (failed.len(), failed.join(", "));
        Err(Failure::new(format!("{count} of {all} steps of `{}` failed: {names}", self.command)))
    }

    fn finish(&mut self, step: &Running, ended: std::io::Result<process::Ended>) {
        println!("==== {} ====", step.name);
        print!("{}", fs::read_to_string(&step.output).unwrap_or_default());
        // What is wrong with it has been printed, and is in the table.
        let _ = self.note(&step.name, step.begun, &step.shown, ended);
    }

    fn note(
        &mut self,
        name: &str,
        begun: Instant,
        shown: &str,
        ended: std::io::Result<process::Ended>,
    ) -> Outcome {
        let wall = begun.elapsed();
        let (cpu, outcome) = match ended {
            Ok(ended) if ended.status.success() => (ended.cpu, Ok(())),
            Ok(ended) => {
                let message = format!("{name}: `{shown}` failed: {}", ended.status);
                let status = ended.status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(1);
                (ended.cpu, Err(Failure { message, status }))
            }
            Err(error) => (None, Err(Failure::new(format!("{name}: `{shown}`: {error}")))),
        };
        if let Err(failure) = &outcome {
            eprintln!("FAILED {failure}");
        }
        self.rows.push(Row { name: name.to_owned(), wall, cpu, failed: outcome.is_err(), part: false });
        outcome
    }

    fn fail(&mut self, name: &str, begun: Instant, error: std::io::Error) {
        let _ = self.note(name, begun, "its output file", Err(error));
    }
}

/// A step that runs beside others.
struct Running {
    name: String,
    shown: String,
    begun: Instant,
    output: PathBuf,
    process: Process,
}

impl Running {
    fn start(step: Step) -> Result<Running, (String, std::io::Error)> {
        let Step { name, mut command } = step;
        let shown = command::shown(&command);
        let folder = folder();
        let output = folder.join(format!("{}.log", name.replace([' ', '/'], "-")));
        let process = fs::create_dir_all(&folder).and_then(|()| File::create(&output)).and_then(|file| {
            command.stderr(file.try_clone()?).stdout(file);
            Process::start(command)
        });
        eprintln!("$ {shown}  (side by side: {name})");
        match process {
            Ok(process) => Ok(Running { name, shown, begun: Instant::now(), output, process }),
            Err(error) => Err((name, error)),
        }
    }
}
