//! A person and a program at the console, by stock pyserial.

use super::bench::truth;
use super::board::Board;
use super::scripts::run;

fn with_console(script: &str) {
    let board = Board::start(script);
    let truth = truth();
    let mut arguments = vec![board.console.as_str()];
    arguments.extend(truth.iter().map(String::as_str));
    run(script, &arguments);
    board.stop();
}

#[test]
fn a_logger_a_person_and_a_program_at_the_console() {
    with_console("console.py");
}

#[test]
fn a_flood_of_garbage_leaves_the_console_as_it_was() {
    with_console("flood.py");
}
