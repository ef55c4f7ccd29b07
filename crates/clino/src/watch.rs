//! `clino watch`: live readings in the terminal.
//!
//! ```text
//!   sensor    angle      status      age   rate/s
//! > t7 5      12.345     ok         0.0 s    10.0
//!   t7 6      -          no_answer  3.2 s     0.0
//! ┌ t7 5, degrees ────────────────────────────────┐
//! ```
//! One thread reads, this one draws: a slow terminal, over SSH for example, holds up no reading. Without a terminal, and with
//! `--plain`, a line for each sensor is printed each second instead; with `--json` one object for each reading.

mod plain;
mod screen;
mod state;

use std::io::{self, IsTerminal as _};

use clap::Args;

use crate::bus::Stop;
use crate::outcome::{DecodeVerdict, Failure};
use crate::sensors::Sensors;
use state::State;

/// `clino watch`
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    sensors: Sensors,
    /// Lines instead of a screen: one for each sensor, each second
    #[arg(long)]
    plain: bool,
    /// No colour; so has it the environment variable NO_COLOR
    #[arg(long)]
    no_color: bool,
}

/// Watches until `q` or Ctrl-C.
pub fn run(arguments: Arguments) -> Result<DecodeVerdict, Failure> {
    let Arguments { sensors, plain, no_color } = arguments;
    let stop = Stop::on_signals()?;
    let json = sensors.port.json;
    let is_plain = plain || json || !io::stdout().is_terminal() || !io::stdin().is_terminal();
    let (named, feed) = sensors.start(&stop)?;
    let mut state = State::new(named);
    if is_plain {
        return plain::run(&mut state, &feed, &sensors.port);
    }
    let has_colour = !no_color && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty());
    let ended = screen::run(&mut state, &feed, &stop, has_colour);
    // A port that could not be opened at all is told when the terminal is as it was.
    match state.never_opened() {
        Some(error) => Err(crate::session::port_failed(&mut sensors.port.say(), error)?),
        None => Ok(ended.map(|()| DecodeVerdict::Good)?),
    }
}
