//! The test programs, built once for all: portable tests, the drivers with all their features, tests of the image.
//!
//! One build means one selection of packages and features. `cargo test --package …` selects others, and then cargo
//! compiles the emulator again because a crate below it has another feature.
//!
//! Programs are named as `cargo nextest` names them: `clino-codec` is the unit tests of a library, `clino-codec::vectors`
//! an integration test, `clino-clino::bin/clino` the unit tests of a program.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;

use serde::Deserialize;

use crate::command::{self, Failure, Outcome};
use crate::firmware::{SHIPPED, Variant};
use crate::steps::{self, Steps};

/// On top of the default features of all default members.
const FEATURES: [&str; 4] = [
    "clino-host-tests/virtual-board",
    "clino-drivers/async",
    "clino-drivers/embedded-io-06",
    "clino-drivers/defmt",
];

/// `cargo` with that selection.
pub fn cargo<'a>(arguments: impl IntoIterator<Item = &'a str>) -> Command {
    let mut cargo = command::cargo(arguments);
    cargo.arg("--features").arg(features());
    with_image(&mut cargo, SHIPPED);
    cargo
}

/// The features of that selection, as cargo takes them.
pub fn features() -> String {
    FEATURES.join(",")
}

/// Tells tests of an image where it is, which board it is for, what it does, and where the virtual board's program is.
pub fn with_image(command: &mut Command, variant: Variant) {
    command.env("CLINO_ELF", variant.elf());
    command.env("CLINO_BOARD", variant.board.name);
    command.env("CLINO_FUNCTIONS", variant.functions);
    command.env("CLINO_SKIPPED", steps::skipped());
    command.env("CLINO_VBOARD", command::target_dir().join("debug").join("vboard"));
}

/// What was built.
pub struct Programs(Vec<Program>);

/// A test program, or an example.
pub struct Program {
    /// As `cargo nextest` has it.
    pub name: String,
    executable: PathBuf,
    /// The folder of its package, in which it runs.
    folder: PathBuf,
    example: bool,
}

impl Programs {
    /// Builds them.
    ///
    /// # Errors
    /// The build's.
    pub fn build(steps: &mut Steps) -> Result<Programs, Failure> {
        Self::built(steps, &[])
    }

    /// Builds them for long runs, some of which measure: with other people's crates optimised, too.
    ///
    /// # Errors
    /// The build's.
    pub fn optimised(steps: &mut Steps) -> Result<Programs, Failure> {
        Self::built(steps, &["--config", "profile.dev.package.\"*\".opt-level=3"])
    }

    fn built(steps: &mut Steps, options: &[&str]) -> Result<Programs, Failure> {
        let list = steps.file("test programs.json");
        let failed = |error: std::io::Error| Failure::new(format!("{}: {error}", list.display()));
        let mut build = cargo(["test", "--no-run", "--message-format", "json-render-diagnostics"]);
        build.args(options).stdout(File::create(&list).map_err(failed)?);
        steps.need("test programs", build)?;
        let text = fs::read_to_string(&list).map_err(failed)?;
        Ok(Programs(text.lines().filter_map(Program::parse).collect()))
    }

    /// Test programs.
    pub fn tests(&self) -> impl Iterator<Item = &Program> {
        self.0.iter().filter(|program| !program.example)
    }

    /// Examples; they are run as they are.
    pub fn examples(&self) -> impl Iterator<Item = &Program> {
        self.0.iter().filter(|program| program.example)
    }

    /// The test program of this name.
    ///
    /// # Errors
    /// There is none.
    pub fn test(&self, name: &str) -> Result<&Program, Failure> {
        let found = self.tests().find(|program| program.name == name);
        found.ok_or_else(|| Failure::new(format!("there is no test program `{name}`")))
    }
}

impl Program {
    /// Runs it.
    pub fn command(&self) -> Command {
        let mut command = Command::new(&self.executable);
        command.current_dir(&self.folder);
        with_image(&mut command, SHIPPED);
        command
    }

    /// Makes sure that it has a test whose name contains this: a filter that no test passes would be a success.
    ///
    /// # Errors
    /// It has none.
    pub fn must_have(&self, test: &str) -> Outcome {
        let output = Command::new(&self.executable).arg("--list").output();
        let list = output.map_err(|error| Failure::new(format!("{}: {error}", self.name)))?.stdout;
        let list = String::from_utf8_lossy(&list);
        let mut names = list.lines().filter_map(|line| line.strip_suffix(": test"));
        if names.any(|name| name.contains(test)) {
            return Ok(());
        }
        Err(Failure::new(format!("`{}` has no test `{test}`", self.name)))
    }

    /// From a line of cargo's messages, if it is about a test program or an example.
    fn parse(line: &str) -> Option<Program> {
        let message: Message = serde_json::from_str(line).ok()?;
        let Target { kind, name: target, .. } = message.target;
        let kind = kind.first()?.as_str();
        let example = kind == "example";
        if !(message.profile.test || example) {
            return None;
        }
        let folder = Path::new(&message.manifest_path).parent()?.to_owned();
        let package = package(&message.package_id)?;
        let name = match kind {
            "test" => format!("{package}::{target}"),
            "bin" | "example" => format!("{package}::{kind}/{target}"),
            _ => package.to_owned(),
        };
        Some(Program { name, executable: message.executable?.into(), folder, example })
    }
}

/// The name in a package's identity, `path+file:///…/crates/codec#clino-codec@0.1.0` or, where the folder is called like the
/// package, `path+file:///…/xtask#0.1.0`.
fn package(identity: &str) -> Option<&str> {
    let (folder, rest) = identity.rsplit_once('#')?;
    match rest.split_once('@') {
        Some((name, _)) => Some(name),
        None => folder.rsplit('/').next(),
    }
}

/// A message of cargo's about something built.
#[derive(Deserialize)]
struct Message {
    package_id: String,
    manifest_path: String,
    target: Target,
    profile: Profile,
    executable: Option<String>,
}

#[derive(Deserialize)]
struct Target {
    kind: Vec<String>,
    name: String,
}

#[derive(Deserialize)]
struct Profile {
    test: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn programs_have_the_names_that_nextest_gives_them() {
        let parse = |id: &str, kind: &str, target: &str, test: bool| {
            let line = format!(
                r#"{{"reason":"compiler-artifact","package_id":"path+file:///p/{id}","manifest_path":"/p/x/Cargo.toml",
                "target":{{"kind":["{kind}"],"name":"{target}"}},"profile":{{"test":{test}}},"executable":"/p/e"}}"#
            );
            Program::parse(&line.replace('\n', "")).map(|program| (program.name, program.example))
        };
        let test = |name: &str| Some((name.to_owned(), false));
        assert_eq!(parse("codec#clino-codec@0.1.0", "lib", "clino_codec", true), test("clino-codec"));
        assert_eq!(parse("codec#clino-codec@0.1.0", "test", "vectors", true), test("clino-codec::vectors"));
        assert_eq!(parse("xtask#0.1.0", "bin", "xtask", true), test("xtask::bin/xtask"));
        assert_eq!(parse("xtask#0.1.0", "bin", "xtask", false), None);
        let example = Some(("clino-drivers::example/rs485".to_owned(), true));
        assert_eq!(parse("drivers#clino-drivers@0.1.0", "example", "rs485", false), example);
        assert_eq!(Program::parse(r#"{"reason":"build-finished","success":true}"#).map(|it| it.name), None);
    }
}
