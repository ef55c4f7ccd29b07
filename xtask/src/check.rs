//! `cargo xtask check`: what no test can show of the reusable crates and of the image, one script each.

use crate::command::{self, Failure, Outcome};
use crate::steps::Steps;

/// A script that shows something, prints its figure, and fails when the figure is not good enough.
struct Check {
    name: &'static str,
    script: &'static str,
    /// Arguments when it runs among all others; named on the command line, it runs without.
    among_all: &'static [&'static str],
    shows: &'static str,
}

const fn script(name: &'static str, script: &'static str, shows: &'static str) -> Check {
    Check { name, script, among_all: &[], shows }
}

const CHECKS: &[Check] = &[
    script(
        "targets",
        "crates/codec/checks/targets.sh",
        "the codec builds for Cortex-M0, Cortex-M4F and RISC-V",
    ),
    script(
        "drivers",
        "crates/drivers/checks/targets.sh",
        "bus, commissioning and drivers build for Cortex-M0 and Cortex-M4F",
    ),
    script("nopanic", "crates/codec/checks/nopanic.sh", "no panic is reachable in the codec"),
    script("nopanic-core", "crates/gateway/checks/nopanic.sh", "no panic is reachable in bus and gateway"),
    script(
        "instructions",
        "crates/codec/checks/instructions.sh",
        "instructions of a decode, under callgrind",
    ),
    Check {
        // The goal is not reached yet; among all others it only guards against growth.
        among_all: &["--ratchet"],
        ..script("size", "crates/codec/checks/size.sh", "flash of the whole codec on a Cortex-M4")
    },
    script("package", "crates/codec/checks/package.sh", "the codec can be published"),
    script(
        "msrv",
        "crates/codec/checks/msrv.sh",
        "the codec's tests pass with the oldest compiler it promises",
    ),
    script("coverage", "crates/codec/checks/coverage.sh", "line and branch coverage of the codec"),
    script("fuzz", "fuzz/checks/fuzz.sh", "30 s of fuzzing for whatever takes bytes from outside"),
    script("stack", "crates/inspect/checks/stack.sh", "worst-case stack of the firmware image"),
    script(
        "panics",
        "crates/inspect/checks/panics.sh",
        "the panics left in the firmware image are those listed",
    ),
    script("throughput", "crates/clino/checks/throughput.sh", "frames a second of the bench tool"),
];

/// Runs the named checks, or all.
pub fn run(names: &[String]) -> Outcome {
    if let Some(unknown) = names.iter().find(|name| !CHECKS.iter().any(|check| check.name == name.as_str())) {
        let known: Vec<String> =
            CHECKS.iter().map(|check| format!("  {:<14}{}", check.name, check.shows)).collect();
        let message = format!("there is no check `{unknown}`, only:\n{}", known.join("\n"));
        return Err(Failure { message, status: crate::BAD_USAGE });
    }
    let all = names.is_empty();
    let mut steps = Steps::new("check");
    for check in CHECKS {
        let named = names.iter().any(|name| name == check.name);
        if named || all {
            let arguments = if named { &[] } else { check.among_all };
            steps.run(check.name, command::script(check.script, arguments));
        }
    }
    steps.end(Ok(()))
}
