//! The scenario file as it is written. Documented for users in `docs/scenario.md`.
//!
//! Serde's `flatten` is not used anywhere: it would let unknown keys through, and lose the places of the values in the
//! file.

mod answers;
mod chip;
mod clients;
mod impairments;
mod intervals;
mod motion;
mod nodes;
mod pwm;
mod segments;

use serde::Deserialize;
use toml::Spanned;

use super::units::Time;

pub use answers::{Fault, Latency};
pub use chip::{Crystal, Injection};
pub use clients::{Console, Modbus, Request, Typed};
pub use impairments::{Echo, Impairment};
pub use intervals::{Babble, Lasting, StuckLevel, bounds};
pub use motion::Moves;
pub use nodes::{Isu, T7};
pub use pwm::Pwm;
pub use segments::{Segment, Segments};

/// Duration of a run that does not say.
const DEFAULT_DURATION: Time = Time(5_000_000_000);

/// The whole file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Decides everything that is left to chance.
    #[serde(default)]
    pub seed: u64,
    /// Virtual time to run.
    #[serde(default = "default_duration")]
    pub duration: Spanned<Time>,
    /// What is the same for all nodes of a segment.
    #[serde(default)]
    pub segments: Segments,
    /// T7 inclinometers on the T7 bus.
    #[serde(default)]
    pub t7: Vec<T7>,
    /// ISU inclinometers on the ISU bus.
    #[serde(default)]
    pub isu: Vec<Isu>,
    /// PWM sources.
    #[serde(default)]
    pub pwm: Vec<Pwm>,
    /// Input typed at the console.
    #[serde(default)]
    pub typed: Vec<Typed>,
    /// The console's line.
    #[serde(default)]
    pub console: Console,
    /// The master at the Modbus port.
    #[serde(default)]
    pub modbus: Modbus,
    /// Faults planted into the running firmware.
    #[serde(default)]
    pub plant: Vec<Injection>,
    /// Frequency of the watchdog's oscillator in Hz.
    pub lsi_hz: Option<Spanned<u32>>,
    /// What the crystal does, and the oscillator that stands in for it.
    #[serde(default)]
    pub crystal: Crystal,
}

fn default_duration() -> Spanned<Time> {
    Spanned::new(0..0, DEFAULT_DURATION)
}
