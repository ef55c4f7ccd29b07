//! A scenario: the sensors of the board, their motion, the faults, and the duration.
//!
//! Read from a TOML file, documented in `docs/scenario.md`. The same file gives the same run, byte for byte:
//! everything that is left to chance comes from `seed`.

mod build;
mod check;
mod hex;
mod planned;
mod schema;
#[cfg(test)]
mod tests;
mod units;

use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};

use clino_sim::motion::Motion;
use clino_sim::node::Ns;

use crate::HostPorts;
use crate::impairment::ImpairedLine;
use crate::injection::Injection;
use crate::modbus::Framing;
use crate::oscillators::Oscillators;
use crate::pwm::PwmWaveform;
use clino_segment::Segment;
use clino_segment::wire::Wire;

use planned::in_order;

pub use planned::Planned;
pub(crate) use units::duration;
pub use units::{BadTime, Time};

/// What is wrong with a scenario file.
#[derive(Debug)]
pub enum ScenarioError {
    /// It cannot be read.
    Unreadable {
        /// The file.
        file: PathBuf,
        /// Why.
        why: std::io::Error,
    },
    /// It says something wrong.
    Wrong {
        /// The file.
        file: PathBuf,
        /// The line, from 1.
        line: usize,
        /// What was wrong, and what was expected.
        what: String,
    },
}

impl fmt::Display for ScenarioError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unreadable { file, why } => {
                write!(f, "{}: {why}, expected a scenario file", file.display())
            }
            Self::Wrong { file, line, what } => write!(f, "{}:{line}: {what}", file.display()),
        }
    }
}

impl std::error::Error for ScenarioError {}

/// Which sensor a slot reads; the names are those of the console's `kind`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// US Digital T7.
    T7,
    /// STT ISU on its serial line.
    Isu,
    /// A PWM input.
    Pwm,
}

/// The identity of a sensor, as the gateway's console names it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct SensorIdentity {
    /// What it is.
    pub kind: Kind,
    /// Where it hangs: `t7`, `isu`, `pwm1`, `pwm2`.
    pub bus: &'static str,
    /// Its address, 0 for PWM.
    pub address: u8,
}

/// What is true about one sensor.
#[derive(Clone, Debug)]
pub struct Truth {
    /// Its identity.
    pub who: SensorIdentity,
    /// The true angle over time.
    pub motion: Motion,
    /// How old the angle in a good answer may be when the answer is complete.
    pub hold: Ns,
    /// How far a right reading may be from the truth, in micro-degrees.
    pub tolerance: i64,
    /// When it cannot be read: unplugged, or its PWM line stands still.
    pub away: Vec<(Ns, Ns)>,
    /// When a fault of its line, not of the sensor, prevents readings.
    pub disturbed: Vec<(Ns, Ns)>,
    /// Some of its answers are lost or spoilt by order of the scenario.
    pub unreliable: bool,
}

/// Everything that a scenario hangs on the board.
pub struct Bench {
    /// The T7 bus.
    pub t7: Segment,
    /// The ISU bus.
    pub isu: Segment,
    /// PWM inputs 1 and 2.
    pub pwm: [Box<dyn PwmWaveform>; 2],
    /// The truth about every sensor in it.
    pub truths: Vec<Truth>,
}

/// A scenario that can be run.
#[derive(Debug)]
pub struct Scenario {
    file: schema::File,
}

impl Scenario {
    /// Reads a scenario file.
    ///
    /// # Errors
    /// The file cannot be read or says something wrong.
    pub fn read(path: &Path) -> Result<Self, ScenarioError> {
        let unreadable = |why| ScenarioError::Unreadable { file: path.to_owned(), why };
        Self::parse(path, &fs::read_to_string(path).map_err(unreadable)?)
    }

    /// Takes the text of a scenario file; `path` is for messages only.
    ///
    /// # Errors
    /// The text says something wrong.
    pub fn parse(path: &Path, text: &str) -> Result<Self, ScenarioError> {
        let wrong = |span: Option<std::ops::Range<usize>>, what: String| {
            let before = text.get(..span.map_or(0, |span| span.start)).unwrap_or(text);
            let line = 1 + before.matches('\n').count();
            ScenarioError::Wrong { file: path.to_owned(), line, what }
        };
        let file: schema::File =
            toml::from_str(text).map_err(|error| wrong(error.span(), error.message().replace('\n', ", ")))?;
        check::file(&file).map_err(|complaint| wrong(Some(complaint.span), complaint.what))?;
        Ok(Self { file })
    }

    /// Virtual time to run.
    pub fn duration(&self) -> Ns {
        self.file.duration.get_ref().0
    }

    /// What is typed at the console, and when, in order.
    pub fn typed(&self) -> impl Iterator<Item = Planned<'_, str>> {
        in_order(self.file.typed.iter().map(schema::Typed::planned))
    }

    /// Bit rate and framing of the master at the Modbus port.
    pub fn modbus(&self) -> Framing {
        self.file.modbus.framing()
    }

    /// What the master at the Modbus port sends, and when, in order.
    pub fn requests(&self) -> impl Iterator<Item = Planned<'_, [u8]>> {
        in_order(self.file.modbus.request.iter().map(schema::Request::planned))
    }

    /// The lines of the console and of the Modbus port with what is done to them.
    pub fn impair(&self, wires: HostPorts<Box<dyn Wire>>) -> HostPorts<ImpairedLine> {
        build::impaired(&self.file, wires)
    }

    /// Faults to be planted into the running firmware.
    pub fn injections(&self) -> impl Iterator<Item = Injection> {
        self.file.plant.iter().map(|plant| Injection {
            at: plant.at.0,
            what: *plant.what.get_ref(),
            level: plant.level,
            times: plant.times.get(),
            again: plant.again.0,
        })
    }

    /// The chip's oscillators.
    pub fn oscillators(&self) -> Oscillators {
        self.file.oscillators()
    }

    /// Makes the sensors, for a run of this scenario from time 0.
    pub fn build(&self) -> Bench {
        build::bench(&self.file)
    }
}
