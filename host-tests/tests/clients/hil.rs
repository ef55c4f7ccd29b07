//! `cargo xtask hil --virtual`: what a person with a board runs works, passes where all is well, and fails where it is not.

use std::fs;
use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};

use super::board::{command, program};

/// Runs it on the virtual board; its exit status and its report.
fn hil(name: &str, arguments: &[&str]) -> (Option<i32>, String) {
    run(name, &[&["--virtual"], arguments].concat())
}

fn run(name: &str, arguments: &[&str]) -> (Option<i32>, String) {
    let vboard = program("CLINO_VBOARD");
    let programs = Path::new(&vboard).parent().expect("a folder");
    let report = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.md"));
    let mut command = Command::new(programs.join("clino-hil"));
    command.arg("--elf").arg(program("CLINO_ELF")).arg("--programs").arg(programs);
    command
        .args(["--board", clino_host_tests::model().name(), "--short", "--report"])
        .arg(&report)
        .args(arguments);
    let output = command.output().expect("`cargo xtask test` builds it");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let text = fs::read_to_string(&report).unwrap_or_else(|why| panic!("{why}: {said}"));
    (output.status.code(), text)
}

/// The row of a check: what was measured, and how it ended.
fn row<'a>(report: &'a str, what: &str) -> (&'a str, &'a str) {
    let row = report.lines().find(|line| line.starts_with(&format!("| {what} |")));
    let row = row.unwrap_or_else(|| panic!("no row `{what}` in {report}"));
    let cells: Vec<&str> = row.split(" | ").collect();
    let [_, _, measured, verdict] = cells[..] else { panic!("{row}") };
    (measured, verdict.trim_end_matches(" |"))
}

#[test]
fn the_virtual_board_passes() {
    let (status, report) = hil("hil", &[]);
    assert_eq!(status, Some(0), "{report}");
    assert!(!report.contains("FAILED") && !report.contains("skipped:"), "{report}");
    for (what, measured) in [
        ("T7 bus: angles", "ok 12.345, ok -170.500, ok 0.001"),
        ("Modbus: test registers", "1234 5678 42f6 e979"),
        ("clock", "\"crystal\""),
    ] {
        assert_eq!(row(&report, what), (measured, "ok"), "{report}");
    }
    assert!(row(&report, "first line of the log").0.contains("after power_on"), "{report}");
}

/// The way of a person with a board that is flashed: ports that are named, one of them wrong.
#[test]
fn ports_that_are_named_are_used_and_a_wrong_one_is_a_failed_check() {
    let mut board = command();
    board.args(["--realtime", "--console-pty", "--modbus-pty", "--t7-pty"]);
    let mut board = board.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("the program starts");
    let mut output = BufReader::new(board.stdout.take().expect("piped"));
    let [console, modbus, t7] = ["console ", "modbus ", "t7 "].map(|port| {
        let mut line = String::new();
        output.read_line(&mut line).expect("a line");
        line.strip_prefix(port).unwrap_or_else(|| panic!("not a {port}: {line:?}")).trim().to_owned()
    });
    let ports = ["--console", &console, "--modbus", &modbus, "--t7", &t7, "--isu", "/dev/there-is-none"];
    let (status, report) = run("hil-ports", &[&ports[..], &["--no-flash"]].concat());
    board.kill().and_then(|()| board.wait()).expect("it was running");
    assert_eq!(status, Some(1), "{report}");
    assert_eq!(row(&report, "T7 bus: angles"), ("ok 12.345, ok -170.500, ok 0.001", "ok"), "{report}");
    assert_eq!(row(&report, "Modbus: test registers").1, "ok", "{report}");
    let isu = row(&report, "ISU bus: adapter");
    assert!(isu.0.contains("/dev/there-is-none") && isu.1.starts_with("**FAILED**"), "{report}");
    assert!(!report.contains("broken off"), "{report}");
}

#[test]
fn a_board_without_its_crystal_fails_and_says_where_to_look() {
    let scenario = Path::new(env!("CARGO_TARGET_TMPDIR")).join("hil-crystal.toml");
    fs::write(&scenario, "crystal = { dead = true, internal_error = 0.015 }\n").expect("a file");
    let (status, report) = hil("hil-crystal", &["--scenario", scenario.to_str().expect("text")]);
    assert_eq!(status, Some(1), "{report}");
    for (what, measured) in [("clock", "\"internal\""), ("t7: bit time", "-1.5")] {
        let row = report.lines().find(|line| line.starts_with(&format!("| {what}"))).expect("a row");
        assert!(row.contains(measured) && row.contains("FAILED**: the crystal"), "{row}");
    }
    // The rest works: 1.5 % is within what a UART bears.
    assert_eq!(row(&report, "T7 bus: angles").1, "ok", "{report}");
}
