//! `cargo xtask check`: what no test can show of the reusable crates and of the image, one script each.

use std::process::Command;

use crate::command::{self, Failure, Outcome};
use crate::programs;
use crate::steps::{self, Step, Steps};

/// A script that shows something, prints its figure, and fails when the figure is not good enough.
struct Check {
    name: &'static str,
    script: &'static str,
    /// Arguments when it runs among all others; named on the command line, it runs without.
    among_all: &'static [&'static str],
    /// It uses all cores, or measures time: it runs after the others, which run side by side.
    alone: bool,
    /// It needs the PC tool, which is built as the tests build it.
    tool: bool,
    shows: &'static str,
}

const fn script(name: &'static str, script: &'static str, shows: &'static str) -> Check {
    Check { name, script, among_all: &[], alone: false, tool: false, shows }
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
    script(
        "driver-size",
        "crates/drivers/checks/size.sh",
        "flash of a program that reads a T7, an ISU, both, on an STM32F411",
    ),
    script(
        "driver-instructions",
        "crates/drivers/checks/instructions.sh",
        "instructions of one angle, under callgrind",
    ),
    Check {
        // Named, it builds all example programs; so does `cargo xtask campaign examples`.
        among_all: &["f411-nb", "linux-serial"],
        tool: true,
        ..script(
            "package",
            "crates/drivers/checks/package.sh",
            "the crates that others use can be published, and example programs build from the packages",
        )
    },
    script(
        "docs",
        "crates/drivers/checks/docs.sh",
        "the documentation of the crates that others use, as docs.rs builds it",
    ),
    script(
        "deny",
        "crates/drivers/checks/deny.sh",
        "licences and origins of what the crates that others use depend on",
    ),
    script(
        "semver",
        "crates/drivers/checks/semver.sh",
        "the public interface of the crates that others use, against the last version",
    ),
    script(
        "msrv",
        "crates/codec/checks/msrv.sh",
        "the crates that others use build with the oldest compiler they promise",
    ),
    script("coverage", "crates/codec/checks/coverage.sh", "line and branch coverage of the codec"),
    Check {
        alone: true,
        ..script("fuzz", "fuzz/checks/fuzz.sh", "5 s of fuzzing for each part that takes bytes from outside")
    },
    script("target-tests", "target-tests/checks/link.sh", "the tests for a real chip build and link"),
    script("stack", "xtask/inspect/checks/stack.sh", "worst-case stack of the firmware image"),
    script(
        "panics",
        "xtask/inspect/checks/panics.sh",
        "the panics left in the firmware image are those listed",
    ),
    Check {
        alone: true,
        ..script("throughput", "crates/clino/checks/throughput.sh", "frames a second of the bench tool")
    },
    Check {
        alone: true,
        ..script("pc", "crates/clino/checks/pc.sh", "the PC tool on a bus: polling, scans, log, first angle")
    },
    script("systems", "crates/clino/checks/systems.sh", "the PC tool builds for Windows and macOS"),
];

/// Targets without an operating system for which the reusable crates are built.
const TARGETS: [&str; 3] = ["thumbv6m-none-eabi", "thumbv7em-none-eabihf", "riscv32imc-unknown-none-elf"];

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
    if all && let Err(failure) = install(&mut steps) {
        return steps.end(Err(failure));
    }
    let wanted = |check: &&Check| all || names.iter().any(|name| name == check.name);
    if CHECKS.iter().filter(wanted).any(|check| check.tool)
        && let Err(failure) = steps.need("clino", programs::cargo(["build", "--bin", "clino"]))
    {
        return steps.end(Err(failure));
    }
    let step = |check: &Check| {
        let arguments = if all { check.among_all } else { &[] };
        let mut script = steps::script(check.script, arguments);
        // For what it builds of the workspace: with other features, most of what that depends on is compiled anew.
        script.env("CLINO_FEATURES", programs::features());
        if check.tool {
            script.env("CLINO_TOOL", command::target_dir().join("debug").join("clino"));
        }
        Step::new(check.name, script)
    };
    let (alone, beside): (Vec<&Check>, Vec<&Check>) =
        CHECKS.iter().filter(wanted).partition(|check| check.alone);
    steps.side_by_side(beside.into_iter().map(step).collect());
    for check in alone {
        steps.side_by_side(vec![step(check)]);
    }
    steps.end(Ok(()))
}

/// Installs what several scripts want of rustup: it must not be run several times at once. What is there stays as it is.
fn install(steps: &mut Steps) -> Outcome {
    let rustup = |arguments: &str| {
        let mut rustup = Command::new("rustup");
        rustup.args(arguments.split(' '));
        rustup
    };
    if command::output_of("rustc", &["+nightly", "--version"]).is_none() {
        steps.need("nightly", rustup("toolchain install nightly --profile minimal"))?;
    }
    steps.need("installed targets", rustup(&format!("target add {}", TARGETS.join(" "))))?;
    steps.need("installed tools", rustup("component add llvm-tools"))?;
    steps.need("installed nightly tools", rustup("component add llvm-tools --toolchain nightly"))
}
