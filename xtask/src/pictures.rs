//! `cargo xtask pictures`: draws the pictures of `docs/bring-up.md` anew, from captures of the virtual board, and takes those of
//! `docs/fleet.md` with a browser.

use crate::command::Outcome;
use crate::firmware;
use crate::programs::Programs;
use crate::steps::Steps;

/// Runs each scenario on the image and draws what the lines do.
pub fn run() -> Outcome {
    let mut steps = Steps::new("pictures");
    let planned = draw(&mut steps);
    steps.end(planned)
}

fn draw(steps: &mut Steps) -> Outcome {
    firmware::build(steps)?;
    let programs = Programs::build(steps)?;
    let board = programs.test("clino-host-tests::board")?;
    board.must_have("pictures::")?;
    let mut command = board.command();
    command.arg("pictures::").env("UPDATE", "1");
    steps.run("pictures", command);
    let fleet = programs.test("clino::fleet")?;
    fleet.must_have("the_page_of_the_shipped_image")?;
    fleet.must_have("the_example_shows")?;
    let mut command = fleet.command();
    command.args(["the_page_of_the_shipped_image", "the_example_shows"]).env("UPDATE", "1");
    steps.run("pictures of a browser", command);
    Ok(())
}
