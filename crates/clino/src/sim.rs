//! `clino sim`: simulated sensors on pseudo-terminals, one for each bus, for programs written for the real ones.
//!
//! ```text
//! program ── pseudo-terminal ── adapter ── pair ┬─ sensor
//!              (clino-pty)    (adapter.rs)       └─ sensor
//! ```
//! The sensors are `clino-sim`'s, the pair is `clino-segment`'s: bits on a line that every receiver samples at its own rate.
//! So a wrong bit rate, two sensors at one address, or a command sent into an answer come out as on a real pair.
//!
//! Virtual time is the time since the start. Nothing happens early; what is due late, because the computer was busy,
//! keeps its virtual time.
//!
//! Limits: a pseudo-terminal has no parity, no stop bits to choose, no break and no modem lines (Linux ignores them),
//! and time ends after 213 days.

mod adapter;
mod arguments;
mod chatter;
mod isu;
mod serve;
mod t7;
mod value;

use std::io::{self, Write as _};

use clino_pty::Terminal;
use clino_segment::chance::Chance;
use clino_segment::{Noise, Segment, SegmentSettings, Station};

use crate::outcome::{DecodeVerdict, Failure};
use adapter::Adapter;
pub use arguments::Arguments;
use chatter::Chatter;
use serve::Bus;

/// Parts of the run that have their own chance.
const T7_BUS: u64 = 1;
const ISU_BUS: u64 = 2;

/// Serves until SIGINT or SIGTERM.
pub fn run(arguments: Arguments) -> Result<DecodeVerdict, Failure> {
    arguments.check().map_err(Failure::Usage)?;
    let chance = Chance::new(arguments.seed);
    let mut buses = Vec::new();
    if !arguments.t7.is_empty() {
        let chance = chance.part(T7_BUS);
        let sensors = arguments.t7.iter().zip(0..).map(|(t7, place)| t7.station(place, chance));
        let sensors = sensors.collect::<Result<_, _>>().map_err(Failure::Usage)?;
        buses.push(bus("t7", t7::DEFAULT_BAUD, sensors, chance, &arguments)?);
    }
    if !arguments.isu.is_empty() {
        let chance = chance.part(ISU_BUS);
        let sensors = arguments.isu.iter().zip(0..).map(|(isu, place)| isu.station(place, chance)).collect();
        buses.push(bus("isu", clino_sim::isu::BAUD, sensors, chance, &arguments)?);
    }
    let stop = serve::Stop::on_signals()?;
    announce(&buses)?;
    serve::until(&stop, &mut buses)?;
    Ok(DecodeVerdict::Good)
}

/// A bus with its sensors, its terminal, and the log of its frames.
fn bus(
    name: &'static str,
    baud: u32,
    sensors: Vec<Station>,
    chance: Chance,
    arguments: &Arguments,
) -> io::Result<Bus> {
    let noise = Noise { bit_errors: arguments.bit_error_rate, ..Noise::default() };
    let mut notes = io::stderr().lock();
    for sensor in &sensors {
        // A note that cannot be written is no error: the bus goes on.
        let _ = writeln!(notes, "{name} bus: {}", sensor.name);
    }
    let segment = Segment::new(SegmentSettings { chance, echo: arguments.echo, noise }, sensors);
    let chatter = Chatter::new(name, segment.log(), arguments.verbose);
    Ok(Bus { terminal: Terminal::open(baud)?, adapter: Adapter::new(segment, baud), chatter })
}

/// Prints the path of each terminal on a line of its own.
fn announce(buses: &[Bus]) -> io::Result<()> {
    let mut output = io::stdout().lock();
    for bus in buses {
        writeln!(output, "{}", bus.terminal.path())?;
    }
    output.flush()
}
