//! `cargo xtask test`: every test there is; `--quick`: the portable ones, and a handful on the image.
//!
//! `cargo nextest`, where it is installed, packs the tests of all programs onto the cores. Without it, programs run side by
//! side, one core each.

use crate::command::{self, Failure, Outcome};
use crate::programs::{self, Program, Programs};
use crate::steps::{Step, Steps};
use crate::{firmware, nextest, size};

/// The package whose tests run the image; all other tests are portable.
const IMAGE_TESTS: &str = "clino-host-tests";
/// The emulated chip against its manual: its tests are ignored by plain `cargo test`, because they need the thumb target.
/// They share one run, and so one process.
const SELFTEST: &str = "clino-board::selftest";

/// Its tests wait most of the time: for silence, and for answers of simulated sensors.
const WAITING: &str = "clino::sim";

/// The codec without the feature that the other tests of it need.
const SHORT_MESSAGES: [&str; 6] =
    ["test", "--package", "clino-codec", "--no-default-features", "--test", "short_messages"];

/// Programs that take longest, longest first: what is left for the end should be short.
const LONGEST: [&str; 8] = [
    "clino-host-tests::soak",
    "clino-host-tests::board",
    "clino-host-tests::recovery",
    "clino-host-tests::storage",
    "clino-host-tests::clients",
    SELFTEST,
    "clino-gateway",
    "clino-commissioning::isu_power_cut",
];

/// A few tests of the image: it reads every angle, notices a lost sensor, takes commands, keeps what is saved, comes back from
/// a crash, and answers a Modbus master.
const HANDFUL: [(&str, &str); 6] = [
    ("clino-host-tests::board", "main_job::every_slot_tells_the_truth"),
    (
        "clino-host-tests::board",
        "unplugging::an_unplugged_t7_reads_no_answer_within_two_polls_and_comes_back",
    ),
    ("clino-host-tests::board", "console::a_slot_is_set_zeroed_and_shown"),
    ("clino-host-tests::board", "saving::what_is_saved_survives_a_reset_and_is_not_written_twice"),
    ("clino-host-tests::recovery", "crashes::a_panic_says_where_it_was"),
    ("clino-host-tests::clients", "modbus::a_request_from_before_the_gateway_has_started_is_answered"),
];

/// Every test.
pub fn run() -> Outcome {
    let mut steps = Steps::new("test");
    let planned = everything(&mut steps);
    steps.end(planned)
}

/// The portable tests, and a handful on the image.
pub fn quick() -> Outcome {
    let mut steps = Steps::new("test --quick");
    let planned = handful(&mut steps);
    steps.end(planned)
}

fn everything(steps: &mut Steps) -> Outcome {
    firmware::build_both(steps)?;
    steps.own("size", size::check)?;
    let programs = Programs::build(steps)?;
    let mut beside = Vec::new();
    if nextest::is_there() {
        nextest::run(steps, None);
    } else {
        beside.extend(longest_first(programs.tests()).map(all_of));
    }
    beside.push(selftest(&programs)?);
    beside.push(Step::new("documentation", programs::cargo(["test", "--doc"])));
    beside.push(Step::new("the codec as the image has it", command::cargo(SHORT_MESSAGES)));
    beside.extend(programs.examples().map(|example| Step::new(&example.name, example.command())));
    steps.side_by_side(beside);
    Ok(())
}

fn handful(steps: &mut Steps) -> Outcome {
    firmware::build(steps)?;
    let programs = Programs::build(steps)?;
    for (program, test) in HANDFUL {
        programs.test(program)?.must_have(test)?;
    }
    if nextest::is_there() {
        let of_image =
            HANDFUL.iter().map(|(program, test)| format!(" | (binary_id({program}) & test(={test}))"));
        nextest::run(steps, Some(format!("not package({IMAGE_TESTS}){}", of_image.collect::<String>())));
        return Ok(());
    }
    let mut beside = Vec::new();
    for (program, test) in HANDFUL {
        let mut command = programs.test(program)?.command();
        command.args(["--exact", test]);
        beside.push(Step::new(format!("{program} {test}"), command));
    }
    let portable = programs.tests().filter(|program| !program.name.starts_with(IMAGE_TESTS));
    beside.extend(longest_first(portable).map(all_of));
    steps.side_by_side(beside);
    Ok(())
}

/// All tests of a program, on one core.
fn all_of(program: &Program) -> Step {
    let mut command = program.command();
    command.env("RUST_TEST_THREADS", if program.name == WAITING { "8" } else { "1" });
    Step::new(&program.name, command)
}

fn selftest(programs: &Programs) -> Result<Step, Failure> {
    let mut command = programs.test(SELFTEST)?.command();
    command.arg("--ignored").env("RUST_TEST_THREADS", "1");
    Ok(Step::new("selftest", command))
}

fn longest_first<'a>(programs: impl Iterator<Item = &'a Program>) -> impl Iterator<Item = &'a Program> {
    let mut programs: Vec<&Program> = programs.collect();
    let place = |program: &&Program| LONGEST.iter().position(|name| *name == program.name);
    programs.sort_by_key(|program| place(program).unwrap_or(LONGEST.len()));
    programs.into_iter()
}
