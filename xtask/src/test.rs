//! `cargo xtask test`: every test there is.

use crate::command::{self, Outcome};
use crate::{firmware, size};

/// The drivers' examples; each checks the angle it reads against the simulated sensor's.
const EXAMPLES: [&str; 6] = ["t7_blocking", "t7_nb", "t7_async", "isu_blocking", "isu_async", "rs485"];

/// With the image on the virtual board: by itself, its storage by itself, and with stock clients in real time.
const SUITES: [&str; 3] = ["board", "storage", "clients"];

/// Portable tests, a day of the gateway core in virtual time, and examples, then the virtual board's own, then the
/// firmware image (built, sized) on it.
pub fn run() -> Outcome {
    command::run(command::cargo(["test"]))?;
    command::run(command::cargo(["test", "--package", "clino-gateway", "--", "--ignored"]))?;
    command::run(command::cargo(["test", "--package", "clino-drivers", "--all-features"]))?;
    for example in EXAMPLES {
        let run = ["run", "--package", "clino-drivers", "--all-features", "--example", example];
        command::run(command::cargo(run))?;
    }
    firmware::add_target()?;
    let selftest = ["test", "--package", "clino-board", "--test", "selftest", "--", "--include-ignored"];
    command::run(command::cargo(selftest))?;
    size::run()?;
    let elf = firmware::build()?;
    command::run(command::cargo(["build", "--package", "clino-board", "--bin", "vboard"]))?;
    for suite in SUITES {
        let package = ["test", "--package", "clino-host-tests", "--features", "virtual-board"];
        let mut tests = command::cargo(package.into_iter().chain(["--test", suite]));
        tests.env("CLINO_ELF", &elf);
        tests.env("CLINO_VBOARD", command::target_dir().join("debug").join("vboard"));
        command::run(tests)?;
    }
    Ok(())
}
