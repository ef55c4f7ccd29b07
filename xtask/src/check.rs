//! `cargo xtask check`: the promises of the reusable crates that no test can show, one script each.

use std::process::Command;

use crate::command::{self, Failure, Outcome};

/// Name, script, and what it shows. Each script installs what it needs and prints its figure.
const CHECKS: &[(&str, &str, &str)] = &[
    ("targets", "crates/codec/checks/targets.sh", "the codec builds for Cortex-M0, Cortex-M4F and RISC-V"),
    ("nopanic", "crates/codec/checks/nopanic.sh", "no panic is reachable in the codec"),
    ("instructions", "crates/codec/checks/instructions.sh", "instructions of a decode, under callgrind"),
    ("size", "crates/codec/checks/size.sh", "flash of the whole codec on a Cortex-M4"),
    ("package", "crates/codec/checks/package.sh", "the codec can be published"),
    ("msrv", "crates/codec/checks/msrv.sh", "the codec's tests pass with the oldest compiler it promises"),
    ("coverage", "crates/codec/checks/coverage.sh", "line and branch coverage of the codec"),
    ("miri", "crates/codec/checks/miri.sh", "the codec's tests under Miri, both byte orders"),
    ("fuzz", "crates/codec/checks/fuzz.sh", "30 s of fuzzing for every decoder"),
    ("throughput", "crates/clino/checks/throughput.sh", "frames a second of the bench tool"),
];

/// Runs the named checks, or all of them.
pub fn run(names: &[String]) -> Outcome {
    if let Some(unknown) = names.iter().find(|name| !CHECKS.iter().any(|(known, ..)| known == name)) {
        let known: Vec<String> = CHECKS.iter().map(|(name, _, what)| format!("  {name:<14}{what}")).collect();
        let message = format!("there is no check `{unknown}`, only:\n{}", known.join("\n"));
        return Err(Failure { message, status: crate::BAD_USAGE });
    }
    for (name, script, _) in CHECKS {
        if names.is_empty() || names.iter().any(|wanted| wanted == name) {
            let mut check = Command::new("sh");
            check.arg(script).current_dir(command::root()).env("CARGO_TARGET_DIR", command::target_dir());
            command::run(check)?;
        }
    }
    Ok(())
}
