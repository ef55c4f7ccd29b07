//! The command line as a whole; each protocol's part of it lives with the protocol.

use clap::{Parser, Subcommand};

#[cfg(feature = "fleet")]
use crate::fleet;
#[cfg(target_os = "linux")]
use crate::sim;
use crate::{gateway, isu, log, manual, ports, pwm, sniff, t7, watch};

const EXIT_STATUSES: &str = "\
Exit status:
  0  every frame is good; the sensor did it; `sim` has been stopped
  1  a frame is bad: {\"error\":{\"kind\":…,\"message\":…}}; the sensor did not do it: {\"what\":\"failed\",\"why\":…}
  2  bad usage, or a program that writes to a sensor without --yes
  3  input, output or the port failed
  4  not done: a person said no, or Ctrl-C stopped it";

/// Sets up US Digital T7 and STT ISU inclinometers, decodes and encodes their frames, and stands in for them.
#[derive(Parser)]
#[command(version, after_help = EXIT_STATUSES, disable_help_subcommand = true)]
pub struct Arguments {
    #[command(subcommand)]
    pub tool: Tool,
}

/// The subcommands.
#[derive(Subcommand)]
pub enum Tool {
    /// US Digital T7: sensors on a port, and frames of the binary protocol
    #[command(subcommand)]
    T7(t7::Tool),
    /// STT ISU: sensors on a port, frames of the binary protocol, and ASCII lines
    #[command(subcommand)]
    Isu(isu::Tool),
    /// The serial ports of this computer, and what to do about those that cannot be opened
    Ports(ports::Arguments),
    /// Live readings in the terminal, with a plot
    Watch(watch::Arguments),
    /// Readings as rows of a file
    Log(log::Arguments),
    /// Listen on a pair, or decode a capture: what both sides say, with times
    Sniff(sniff::Arguments),
    /// The configuration of a gateway as text, and back
    #[command(subcommand)]
    Gateway(gateway::Tool),
    /// STT ISU, pulse width: timer ticks to duty and angle
    #[command(allow_negative_numbers = true)]
    Pwm(pwm::Arguments),
    /// Gateways on a live page in a browser
    #[cfg(feature = "fleet")]
    Serve(fleet::ServeArguments),
    /// Gateways to an MQTT broker, to Prometheus, to InfluxDB
    #[cfg(feature = "fleet")]
    Bridge(fleet::BridgeArguments),
    /// Simulated sensors of both makes, served on pseudo-terminals or on a port
    #[cfg(target_os = "linux")]
    Sim(sim::Arguments),
    /// Completions for a shell, to standard output
    Completions(manual::Completions),
    /// The manual page, to standard output, or those of all commands into a folder
    Man(manual::Manual),
}
