//! `cargo xtask test`: every test there is; `--quick`: the portable ones, and a handful on the image.
//!
//! `cargo nextest`, where it is installed, packs the tests of all programs onto the cores. Without it, programs run side by
//! side, one core each.

use crate::command::{self, Failure, Outcome};
use crate::firmware::{
    self, ISU_MODBUS_STORAGE, MODBUS_STORAGE, PWM_MODBUS_STORAGE, SHIPPED, T7_CONSOLE, T7_MODBUS,
    T7_MODBUS_STORAGE, Variant, WITHOUT_CONSOLE,
};
use crate::programs::{self, Program, Programs};
use crate::steps::{Step, Steps};
use crate::{boards, nextest, size, witness};

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

/// Bus and drivers without the feature that remembers each node.
const FEW_NODES: [&str; 11] = [
    "test",
    "--package",
    "clino-bus",
    "--package",
    "clino-drivers",
    "--no-default-features",
    "--features",
    "clino-drivers/nb,clino-drivers/embedded-io,clino-drivers/async",
    "--lib",
    "--test",
    "exchanges",
];

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

/// A test program, as `cargo nextest` names it, and a test of it.
type Test = (&'static str, &'static str);

/// The images that leave something out: the main ones of [`firmware::COMBINATIONS`].
const SMALL: [Variant; 7] = [
    WITHOUT_CONSOLE,
    MODBUS_STORAGE,
    T7_MODBUS_STORAGE,
    T7_MODBUS,
    T7_CONSOLE,
    ISU_MODBUS_STORAGE,
    PWM_MODBUS_STORAGE,
];

/// A few tests of the image: it reads every angle, notices a lost sensor, takes commands, keeps what is saved, comes back from
/// a crash, and answers a Modbus master.
const HANDFUL: [Test; 6] = [
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

/// What runs on the image for another board every day: the main job, what is different about the board, and what depends on its
/// memories. `cargo xtask campaign nucleo` runs everything.
const ON_ANOTHER_BOARD: [Test; 9] = [
    ("clino-host-tests::board", "main_job::every_slot_tells_the_truth"),
    ("clino-host-tests::board", "registers::every_register_is_as_the_image_relies_on_it"),
    ("clino-host-tests::board", "console::a_slot_is_set_zeroed_and_shown"),
    ("clino-host-tests::board", "saving::what_is_saved_survives_a_reset_and_is_not_written_twice"),
    ("clino-host-tests::board", "wrong_chip::the_image_says_so_and_does_nothing_on_another_chip"),
    ("clino-host-tests::recovery", "crashes::a_panic_says_where_it_was"),
    ("clino-host-tests::recovery", "crashes::a_stack_that_overflows_meets_no_data"),
    ("clino-host-tests::recovery", "power_ups::a_power_up_is_counted_once_and_a_reset_is_not"),
    ("clino-host-tests::clients", "modbus::a_request_from_before_the_gateway_has_started_is_answered"),
];

/// What runs on the images that leave something out.
const ON_SMALL_ONES: [Test; 3] = [
    ("clino-host-tests::board", "parts::the_modbus_port_has_what_is_there_and_nothing_else"),
    ("clino-host-tests::board", "parts::the_console_has_what_is_there_and_nothing_else"),
    (
        "clino-host-tests::board",
        "parts::settings_of_a_part_that_is_absent_are_left_for_the_image_that_has_it",
    ),
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
    let nucleo = Variant::of(boards::NUCLEO);
    firmware::build_all(steps, &[&size::MEASURED[..], &SMALL, &[nucleo]].concat())?;
    steps.own("size", size::check)?;
    let programs = Programs::build(steps)?;
    must_have(&programs, &ON_ANOTHER_BOARD)?;
    must_have(&programs, &ON_SMALL_ONES)?;
    let mut beside = Vec::new();
    if nextest::is_there() {
        nextest::run(steps, None, SHIPPED);
        nextest::run(steps, Some(filter(ON_ANOTHER_BOARD.iter())), nucleo);
        for small in SMALL {
            nextest::run(steps, Some(filter(ON_SMALL_ONES.iter())), small);
        }
    } else {
        beside.extend(longest_first(programs.tests()).map(all_of));
        for test in ON_ANOTHER_BOARD {
            beside.push(one(&programs, test, nucleo)?);
        }
        for small in SMALL {
            for test in ON_SMALL_ONES {
                beside.push(one(&programs, test, small)?);
            }
        }
    }
    beside.push(selftest(&programs)?);
    beside.extend(witness::daily(steps)?);
    beside.push(Step::new("documentation", programs::cargo(["test", "--doc"])));
    beside.push(Step::new("the codec as the image has it", command::cargo(SHORT_MESSAGES)));
    beside.push(Step::new("bus and drivers for few nodes", command::cargo(FEW_NODES)));
    beside.extend(programs.examples().map(|example| Step::new(&example.name, example.command())));
    steps.side_by_side(beside);
    Ok(())
}

fn handful(steps: &mut Steps) -> Outcome {
    firmware::build(steps)?;
    let programs = Programs::build(steps)?;
    must_have(&programs, &HANDFUL)?;
    if nextest::is_there() {
        let wanted = format!("not package({IMAGE_TESTS}) | {}", filter(HANDFUL.iter()));
        nextest::run(steps, Some(wanted), SHIPPED);
        return Ok(());
    }
    let mut beside = Vec::new();
    for test in HANDFUL {
        beside.push(one(&programs, test, SHIPPED)?);
    }
    let portable = programs.tests().filter(|program| !program.name.starts_with(IMAGE_TESTS));
    beside.extend(longest_first(portable).map(all_of));
    steps.side_by_side(beside);
    Ok(())
}

/// Makes sure that the programs have these tests.
fn must_have(programs: &Programs, tests: &[Test]) -> Outcome {
    tests.iter().try_for_each(|(program, test)| programs.test(program)?.must_have(test))
}

/// Selects these tests.
fn filter<'a>(tests: impl Iterator<Item = &'a Test>) -> String {
    let tests: Vec<String> =
        tests.map(|(program, test)| format!("(binary_id({program}) & test(={test}))")).collect();
    tests.join(" | ")
}

/// One test of an image.
fn one(programs: &Programs, (program, test): Test, variant: Variant) -> Result<Step, Failure> {
    let mut command = programs.test(program)?.command();
    command.args(["--exact", test]);
    programs::with_image(&mut command, variant);
    Ok(Step::new(format!("{program} {test} {}", variant.step()), command))
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
