//! Building the firmware image: for which board, with which functions, with its log or without.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use crate::boards::{self, Board};
use crate::command::{self, Failure, Outcome};
use crate::steps::Steps;

/// Cortex-M4 with its floating-point unit.
pub const TARGET: &str = "thumbv7em-none-eabihf";
/// The root package.
pub const PACKAGE: &str = "clino-firmware";

/// An image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Variant {
    /// What it is called, and its file; empty for the shipped one.
    pub name: &'static str,
    /// The board that it is for.
    pub board: Board,
    /// What it does: features of the firmware.
    pub functions: &'static str,
    /// With its log.
    pub has_log: bool,
}

/// Everything.
const FULL: &str = "full";

/// The image that is shipped: everything, with its log, for the default board.
pub const SHIPPED: Variant = Variant::of(boards::DEFAULT);

/// The same without its log.
pub const WITHOUT_LOG: Variant = Variant { name: "without-log", has_log: false, ..SHIPPED };

/// Without one part.
pub const WITHOUT_CONSOLE: Variant = part("without-console", "modbus,storage,commissioning,isu,pwm");
/// Without one part.
pub const WITHOUT_MODBUS: Variant = part("without-modbus", "console,storage,commissioning,isu,pwm");
/// Without one part.
pub const WITHOUT_COMMISSIONING: Variant = part("without-commissioning", "console,modbus,storage,isu,pwm");
/// Without one part.
pub const WITHOUT_ISU: Variant = part("without-isu", "console,modbus,storage,commissioning,pwm");
/// Without one part.
pub const WITHOUT_PWM: Variant = part("without-pwm", "console,modbus,storage,commissioning,isu");
/// Without the stored configuration, and the console that needs it.
pub const WITHOUT_STORAGE: Variant = part("without-storage", "modbus,commissioning,isu,pwm");
/// All sensors at the Modbus port.
pub const MODBUS_STORAGE: Variant = part("modbus-storage", "modbus,storage,isu,pwm");
/// T7s at the Modbus port.
pub const T7_MODBUS_STORAGE: Variant = part("t7-modbus-storage", "modbus,storage");
/// The same, as delivered at each start: the smallest one.
pub const T7_MODBUS: Variant = part("t7-modbus", "modbus");
/// T7s at the console.
pub const T7_CONSOLE: Variant = part("t7-console", "console");
/// T7s and ISUs at the Modbus port.
pub const ISU_MODBUS_STORAGE: Variant = part("isu-modbus-storage", "modbus,storage,isu");
/// T7s and PWM inputs at the Modbus port.
pub const PWM_MODBUS_STORAGE: Variant = part("pwm-modbus-storage", "modbus,storage,pwm");

/// The combinations of parts that make sense; `cargo xtask features` builds them.
pub const COMBINATIONS: [Variant; 13] = [
    WITHOUT_LOG,
    WITHOUT_CONSOLE,
    WITHOUT_MODBUS,
    WITHOUT_COMMISSIONING,
    WITHOUT_ISU,
    WITHOUT_PWM,
    WITHOUT_STORAGE,
    MODBUS_STORAGE,
    T7_MODBUS_STORAGE,
    T7_MODBUS,
    T7_CONSOLE,
    ISU_MODBUS_STORAGE,
    PWM_MODBUS_STORAGE,
];

/// An image with these parts, without its log.
const fn part(name: &'static str, functions: &'static str) -> Variant {
    Variant { name, functions, ..WITHOUT_LOG }
}

/// Builds every combination of parts, and nothing else.
pub fn features() -> Outcome {
    let mut steps = Steps::new("features");
    let built = build_all(&mut steps, &COMBINATIONS);
    steps.end(built)
}

impl Variant {
    /// The same for another board.
    pub const fn on(self, board: Board) -> Variant {
        Variant { board, ..self }
    }

    /// The shipped image for a board.
    pub const fn of(board: Board) -> Variant {
        Variant { name: "", board, functions: FULL, has_log: true }
    }

    /// Where it is after it was built.
    pub fn elf(&self) -> PathBuf {
        let mut name = String::from(PACKAGE);
        let board = if self.board == boards::DEFAULT { "" } else { self.board.name };
        for part in [board, self.name].into_iter().filter(|part| !part.is_empty()) {
            name = format!("{name}-{part}");
        }
        built().with_file_name(name)
    }

    /// What a step that builds it is called.
    pub fn step(&self) -> String {
        let board = if self.board == boards::DEFAULT { "" } else { self.board.name };
        ["image", board, self.name].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(" ")
    }

    /// How cargo is told to build it.
    pub fn selection(&self) -> Vec<String> {
        let mut selection: Vec<String> = ["--package", PACKAGE, "--target", TARGET].map(String::from).into();
        if *self != SHIPPED {
            let log = if self.has_log { ",defmt" } else { "" };
            let features = format!("{},board-{}{log}", self.functions, self.board.name);
            let features = features.trim_start_matches(',').to_owned();
            selection.extend(["--no-default-features".into(), "--features".into(), features]);
        }
        selection
    }
}

/// Where cargo puts a release image.
fn built() -> PathBuf {
    command::target_dir().join(TARGET).join("release").join(PACKAGE)
}

/// Builds the shipped image.
pub fn build(steps: &mut Steps) -> Outcome {
    build_all(steps, &[SHIPPED])
}

/// Builds these images. They are built in one folder, so that what they have in common is built once; the shipped one comes
/// last, if it is among them, and stays where everybody looks for it.
pub fn build_all(steps: &mut Steps, variants: &[Variant]) -> Outcome {
    add_target()?;
    let (shipped, others): (Vec<Variant>, Vec<Variant>) =
        variants.iter().partition(|variant| **variant == SHIPPED);
    for variant in others.into_iter().chain(shipped) {
        let selection = variant.selection();
        let mut build = command::cargo(["build", "--release"]);
        build.args(selection);
        steps.need(&variant.step(), build)?;
        let (from, to) = (built(), variant.elf());
        if from != to {
            let failed = |error| Failure::new(format!("{} to {}: {error}", from.display(), to.display()));
            fs::copy(&from, &to).map_err(failed)?;
        }
    }
    Ok(())
}

/// Installs the target's standard library if it is missing.
pub fn add_target() -> Outcome {
    let installed = command::output_of("rustup", &["target", "list", "--installed"]).ok_or_else(|| {
        Failure::new(format!("rustup is missing; it is needed to install the target {TARGET}"))
    })?;
    if installed.lines().any(|line| line == TARGET) {
        return Ok(());
    }
    let mut rustup = Command::new("rustup");
    rustup.args(["target", "add", TARGET]).current_dir(command::root());
    command::run(rustup)
}
