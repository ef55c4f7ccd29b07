//! Running tests with `cargo nextest`, and adding up what took how long.
//!
//! The times are in the JUnit report, whose place is in `.config/nextest.toml`: a `testsuite` for each program with a
//! `testcase` for each test, one element a line.

use std::collections::BTreeMap;
use std::env;
use std::fs;
use std::time::Duration;

use crate::command;
use crate::firmware::{SHIPPED, Variant};
use crate::programs;
use crate::steps::Steps;

/// Whether it is there, new enough for `.config/nextest.toml`, and wanted: `CLINO_TEST_RUNNER=cargo` does without it.
pub fn is_there() -> bool {
    let unwanted = env::var_os("CLINO_TEST_RUNNER").is_some_and(|name| name == "cargo");
    !unwanted && command::output_of("cargo", &["nextest", "show-config", "version"]).is_some()
}

/// Runs the tests that a filter selects, or all that are not ignored, on this image.
pub fn run(steps: &mut Steps, filter: Option<String>, variant: Variant) {
    let mut nextest = programs::cargo(["nextest", "run"]);
    programs::with_image(&mut nextest, variant);
    nextest.args(filter.iter().flat_map(|filter| ["-E", filter]));
    let report = command::target_dir().join("nextest/default/junit.xml");
    // That of the last run, if there is one, is not for this table; without a report, it is shorter.
    let _ = fs::remove_file(&report);
    let step =
        if variant == SHIPPED { "tests".to_owned() } else { format!("tests of the {}", variant.step()) };
    steps.run(&step, nextest);
    let report = fs::read_to_string(report).unwrap_or_default();
    let mut programs: Vec<_> =
        add_up(&report).into_iter().map(|(name, (time, failed))| (name, time, failed)).collect();
    programs.sort_by_key(|(_, time, _)| std::cmp::Reverse(*time));
    steps.consisted_of(programs);
}

/// How long the tests of each program took together, and whether one of them failed.
fn add_up(report: &str) -> BTreeMap<String, (Duration, bool)> {
    let mut programs = BTreeMap::new();
    let mut last = String::new();
    for line in report.lines().map(str::trim_start) {
        if line.starts_with("<testcase ") {
            let (Some(program), Some(time)) = (attribute(line, "classname"), attribute(line, "time")) else {
                continue;
            };
            last = program.to_owned();
            let (sum, _) = programs.entry(last.clone()).or_insert((Duration::ZERO, false));
            *sum +=
                time.parse().ok().and_then(|time| Duration::try_from_secs_f64(time).ok()).unwrap_or_default();
        } else if (line.starts_with("<failure") || line.starts_with("<error"))
            && let Some((_, failed)) = programs.get_mut(&last)
        {
            *failed = true;
        }
    }
    programs
}

/// The value of an XML attribute.
fn attribute<'a>(element: &'a str, name: &str) -> Option<&'a str> {
    let (_, value) = element.split_once(&format!(" {name}=\""))?;
    value.split('"').next()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tests_of_each_program_are_added_up() {
        let report = r#"<?xml version="1.0" encoding="UTF-8"?>
<testsuites name="nextest-run" tests="3" failures="1" time="16.758">
    <testsuite name="clino::sim" tests="2">
        <testcase name="bus::a" classname="clino::sim" timestamp="2026-11-29" time="2.626"/>
        <testcase name="bus::b" classname="clino::sim" timestamp="2026-11-29" time="1.5">
            <failure type="test failure with exit code 101">thread</failure>
        </testcase>
    </testsuite>
    <testsuite name="clino-bus" tests="1">
        <testcase name="c" classname="clino-bus" timestamp="2026-11-29" time="0.250"/>
    </testsuite>
</testsuites>"#;
        let programs: Vec<_> = add_up(report).into_iter().collect();
        let expected = [
            ("clino-bus".to_owned(), (Duration::from_millis(250), false)),
            ("clino::sim".to_owned(), (Duration::from_millis(4_126), true)),
        ];
        assert_eq!(programs, expected);
    }
}
