//! `cargo xtask hil --virtual`: what a person with a board runs works, passes where all is well, and fails where it is not.

use std::fs;
use std::path::Path;
use std::process::Command;

use super::board::program;

/// Runs it; its exit status and its report.
fn hil(name: &str, arguments: &[&str]) -> (Option<i32>, String) {
    let vboard = program("CLINO_VBOARD");
    let programs = Path::new(&vboard).parent().expect("a folder");
    let report = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.md"));
    let mut command = Command::new(programs.join("clino-hil"));
    command.arg("--elf").arg(program("CLINO_ELF")).arg("--programs").arg(programs);
    command.args(["--virtual", "--short", "--report"]).arg(&report).args(arguments);
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
