//! `cargo xtask hil`: the image on a board, with this computer at all its ports, and a report.
//!
//! ```text
//! console ── 3.3 V USB-UART ──┐
//! T7s     ── USB-RS485 ───────┤
//! ISU     ── USB-RS485 ───────┼── board ── ST-LINK (flash, log)
//! Modbus  ── USB-RS485 ───────┤
//! DE, RO  ── logic analyser ──┘
//! ```
//!
//! The sensors are simulated: `clino sim` behind the adapters. A USB adapter answers late, so that the slots' timeouts are set
//! first. `--virtual` runs the same code against the virtual board's pseudo-terminals, in real time; `--qemu` what of it can be
//! seen there against QEMU's ([`qemu`]).
//!
//! Every wait has a deadline ([`patience`]); a computer under load makes the run longer, not wrong. Times of the wires come
//! from the board's own counters and from a capture, never from this computer's clock.

mod arguments;
mod board;
mod checks;
mod console;
mod modbus;
mod patience;
mod port;
mod ports;
mod qemu;
mod report;
mod sensors;

use std::process::ExitCode;

use clap::Parser as _;

use arguments::Arguments;
use report::Report;

/// Exit status when the run could not be made.
const BROKEN: u8 = 2;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let mut report = Report::default();
    let ran = checks::all(&arguments, &mut report);
    if let Err(why) = &ran {
        report.broke_off(why);
    }
    let text = report.markdown(&arguments);
    println!("{text}");
    if let Err(why) = std::fs::write(&arguments.report, &text) {
        eprintln!("error: {}: {why}", arguments.report.display());
        return ExitCode::from(BROKEN);
    }
    eprintln!("report: {}", arguments.report.display());
    match ran {
        Err(_) => ExitCode::from(BROKEN),
        Ok(()) if report.failed() == 0 => ExitCode::SUCCESS,
        Ok(()) => ExitCode::FAILURE,
    }
}
