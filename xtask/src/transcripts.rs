//! `cargo xtask transcripts`: writes the console transcripts of the documents anew.

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
    Ok(())
}
