//! The command line as a whole; each protocol's part of it lives with the protocol.

use clap::{Parser, Subcommand};

#[cfg(target_os = "linux")]
use crate::sim;
use crate::{isu, pwm, t7};

const EXIT_STATUSES: &str = "\
Exit status:
  0  every frame is good; `sim` has been stopped
  1  a frame is bad; the JSON object says why: {\"error\":{\"kind\":…,\"message\":…}}
  2  bad usage; the message on stderr names the value and its limits
  3  input or output failed";

/// Decodes and encodes frames of US Digital T7 and STT ISU inclinometers, and stands in for them.
#[derive(Parser)]
#[command(version, after_help = EXIT_STATUSES, disable_help_subcommand = true)]
pub struct Arguments {
    #[command(subcommand)]
    pub tool: Tool,
}

/// The subcommands.
#[derive(Subcommand)]
pub enum Tool {
    /// US Digital T7, binary protocol
    #[command(subcommand)]
    T7(t7::Tool),
    /// STT ISU, binary protocol and ASCII lines
    #[command(subcommand)]
    Isu(isu::Tool),
    /// STT ISU, pulse width: timer ticks to duty and angle
    #[command(allow_negative_numbers = true)]
    Pwm(pwm::Arguments),
    /// Simulated sensors of both makes, served on pseudo-terminals
    #[cfg(target_os = "linux")]
    Sim(sim::Arguments),
}
