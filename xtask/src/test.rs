//! `cargo xtask test`: every test there is.

use std::fs::{self, File};
use std::path::PathBuf;
use std::process::{Child, Command};

use crate::command::{self, Failure, Outcome};
use crate::{firmware, size};

/// The drivers' examples; each checks the angle it reads against the simulated sensor's.
const EXAMPLES: [&str; 6] = ["t7_blocking", "t7_nb", "t7_async", "isu_blocking", "isu_async", "rs485"];

/// With the image on the virtual board: by itself, when it goes wrong, its storage by itself, and with stock clients in
/// real time.
const SUITES: [&str; 4] = ["board", "recovery", "storage", "clients"];

/// The firmware image (built, sized); beside everything else ten minutes of it on the virtual board, and a month of the
/// gateway core in virtual time; portable tests and examples; the virtual board's own; the image on the virtual board.
pub fn run() -> Outcome {
    size::run()?;
    let elf = firmware::build()?;
    command::run(command::cargo(["build", "--package", "clino-board", "--bin", "vboard"]))?;
    let mut soak = firmware::suite(&elf, "soak");
    soak.args(["--", "--nocapture", "--test-threads", "1"]);
    let soak = Beside::start("soak", soak)?;

    command::run(command::cargo(["test"]))?;
    command::run(command::cargo(["test", "--package", "clino-drivers", "--all-features"]))?;
    for example in EXAMPLES {
        let run = ["run", "--package", "clino-drivers", "--all-features", "--example", example];
        command::run(command::cargo(run))?;
    }
    let selftest = ["test", "--package", "clino-board", "--test", "selftest", "--", "--include-ignored"];
    command::run(command::cargo(selftest))?;
    let core = ["test", "--package", "clino-gateway", "--lib", "--", "--ignored", "--nocapture"];
    let core = Beside::start("core", command::cargo(core))?;
    for suite in SUITES {
        command::run(firmware::suite(&elf, suite))?;
    }
    core.end()?;
    soak.end()
}

/// Something long that runs beside the rest; what it prints is kept until it has ended.
struct Beside {
    name: &'static str,
    child: Child,
    output: PathBuf,
}

impl Beside {
    fn start(name: &'static str, mut command: Command) -> Result<Beside, Failure> {
        let output = command::target_dir().join(format!("{name}.log"));
        let failed = |error| Failure::new(format!("{name}: {error}"));
        let file = File::create(&output).map_err(failed)?;
        command.stderr(file.try_clone().map_err(failed)?).stdout(file);
        eprintln!("({name} runs beside what follows)");
        Ok(Beside { name, child: command.spawn().map_err(failed)?, output })
    }

    fn end(mut self) -> Outcome {
        eprintln!("(waiting for {})", self.name);
        let ended = self.child.wait();
        print!("{}", fs::read_to_string(&self.output).unwrap_or_default());
        match ended {
            Ok(status) if status.success() => Ok(()),
            Ok(status) => Err(Failure::new(format!("{} failed: {status}", self.name))),
            Err(error) => Err(Failure::new(format!("{}: {error}", self.name))),
        }
    }
}

impl Drop for Beside {
    /// What failed ends everything: cargo, and the tests that it runs.
    fn drop(&mut self) {
        if !matches!(self.child.try_wait(), Ok(None)) {
            return;
        }
        _ = Command::new("pkill").args(["-P", &self.child.id().to_string()]).status();
        _ = self.child.kill();
    }
}
