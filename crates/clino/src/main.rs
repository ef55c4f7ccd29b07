#![forbid(unsafe_code)]
//! `clino`: T7 and ISU inclinometers at a PC: set up through a serial port, frames taken apart and put together, sensors
//! simulated.
//!
//! What it does and says is in the README and in `clino --help`. The protocols are the codec's business; this
//! crate turns text into bytes, and messages into JSON with names that do not change.

mod arguments;
mod bad;
mod bus;
mod choice;
mod feed;
#[cfg(feature = "fleet")]
mod fleet;
mod gateway;
mod hex;
mod isu;
mod log;
mod manual;
mod number;
mod outcome;
mod parameter;
mod poll;
mod port;
mod ports;
mod pwm;
mod report;
mod say;
mod sensors;
mod session;
#[cfg(target_os = "linux")]
mod sim;
mod sniff;
mod stream;
mod t7;
mod watch;

use std::process::ExitCode;

use clap::{CommandFactory as _, Parser as _};

use arguments::{Arguments, Tool};
use outcome::{DecodeVerdict, Failure};

fn main() -> ExitCode {
    // Clap itself ends the process for help, version, and arguments that it can tell are wrong (status 2).
    outcome::exit_code(run(Arguments::parse().tool))
}

fn run(tool: Tool) -> Result<DecodeVerdict, Failure> {
    match tool {
        Tool::T7(tool) => t7::run(tool),
        Tool::Isu(tool) => isu::run(tool),
        Tool::Ports(arguments) => ports::run(&arguments),
        Tool::Watch(arguments) => watch::run(arguments),
        Tool::Log(arguments) => log::run(arguments),
        Tool::Sniff(arguments) => sniff::run(arguments),
        Tool::Gateway(tool) => gateway::run(tool),
        Tool::Completions(arguments) => manual::completions(&arguments, Arguments::command()),
        Tool::Man(arguments) => manual::manual(&arguments, Arguments::command()),
        Tool::Pwm(ticks) => pwm::run(ticks),
        #[cfg(feature = "fleet")]
        Tool::Serve(arguments) => fleet::serve(arguments),
        #[cfg(feature = "fleet")]
        Tool::Bridge(arguments) => fleet::bridge(&arguments),
        #[cfg(target_os = "linux")]
        Tool::Sim(arguments) => sim::run(arguments),
    }
}
