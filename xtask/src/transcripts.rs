//! `cargo xtask transcripts`: writes the console transcripts of the documents anew, and what `docs/fleet.md` shows of the bridge.

use crate::command::Outcome;
use crate::firmware;
use crate::programs::Programs;
use crate::steps::Steps;

/// Runs each scenario on the image and writes what it prints into its document.
pub fn run() -> Outcome {
    let mut steps = Steps::new("transcripts");
    let planned = write(&mut steps);
    steps.end(planned)
}

fn write(steps: &mut Steps) -> Outcome {
    firmware::build(steps)?;
    let programs = Programs::build(steps)?;
    let board = programs.test("clino-host-tests::board")?;
    board.must_have("transcripts::")?;
    let mut command = board.command();
    command.arg("transcripts::").env("UPDATE", "1");
    steps.run("transcripts", command);
    let fleet = programs.test("clino::fleet")?;
    fleet.must_have("documents::the_document_shows")?;
    let mut command = fleet.command();
    command.arg("documents::the_document_shows").env("UPDATE", "1");
    steps.run("transcripts of the bridge", command);
    Ok(())
}
