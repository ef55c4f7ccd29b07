//! `clino sim`: simulated sensors on pseudo-terminals, one for each bus, or on a real port, for programs and boards made for
//! the real ones.
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
mod attached;
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
use crate::port::{self, PortName, Wiring};
use crate::say::Say;
use adapter::Adapter;
pub use arguments::Arguments;
use attached::Attached;
use chatter::Chatter;
use serve::Bus;

/// Parts of the run that have their own chance.
const T7_BUS: u64 = 1;
const ISU_BUS: u64 = 2;

/// Serves until SIGINT or SIGTERM.
pub fn run(arguments: Arguments) -> Result<DecodeVerdict, Failure> {
    arguments.check().map_err(Failure::Usage)?;
    let mut pairs = Vec::new();
    let chance = Chance::new(arguments.seed);
    if !arguments.t7.is_empty() {
        let chance = chance.part(T7_BUS);
        let sensors = arguments.t7.iter().zip(0..).map(|(t7, place)| t7.station(place, chance));
        let sensors = sensors.collect::<Result<_, _>>().map_err(Failure::Usage)?;
        pairs.push(pair("t7", t7::DEFAULT_BAUD, sensors, chance, &arguments));
    }
    if !arguments.isu.is_empty() {
        let chance = chance.part(ISU_BUS);
        let sensors = arguments.isu.iter().zip(0..).map(|(isu, place)| isu.station(place, chance)).collect();
        pairs.push(pair("isu", clino_sim::isu::BAUD, sensors, chance, &arguments));
    }
    if let Some(name) = &arguments.port {
        let wiring = Wiring { rts_de: arguments.rts_de, rs485: arguments.rs485 };
        // One protocol on a port: there is one pair.
        let Some(pair) = pairs.pop() else { return Ok(DecodeVerdict::Good) };
        return attach(pair, name, wiring);
    }
    let buses = pairs.into_iter().map(Pair::on_terminal).collect::<io::Result<Vec<_>>>();
    let mut buses = buses?;
    let stop = serve::Stop::on_signals()?;
    announce(buses.iter().map(|bus| bus.terminal.path()))?;
    serve::until(&stop, &mut buses)?;
    Ok(DecodeVerdict::Good)
}

/// A bus with its sensors and the log of its frames, connected to nothing yet.
struct Pair {
    segment: Segment,
    chatter: Chatter,
    /// What a program finds it at.
    baud: u32,
}

fn pair(name: &'static str, baud: u32, sensors: Vec<Station>, chance: Chance, arguments: &Arguments) -> Pair {
    let noise = Noise { bit_errors: arguments.bit_error_rate, ..Noise::default() };
    let mut notes = io::stderr().lock();
    for sensor in &sensors {
        // A note that cannot be written is no error: the bus goes on.
        let _ = writeln!(notes, "{name} bus: {}", sensor.name);
    }
    let segment = Segment::new(SegmentSettings { chance, echo: arguments.echo, noise }, sensors);
    let chatter = Chatter::new(name, segment.log(), arguments.verbose);
    Pair { segment, chatter, baud }
}

impl Pair {
    fn on_terminal(self) -> io::Result<Bus> {
        let Self { segment, chatter, baud } = self;
        Ok(Bus { terminal: Terminal::open(baud)?, adapter: Adapter::new(segment, baud), chatter })
    }
}

/// Serves a bus on a port until SIGINT, SIGTERM or SIGHUP.
fn attach(pair: Pair, name: &PortName, wiring: Wiring) -> Result<DecodeVerdict, Failure> {
    let Pair { segment, chatter, baud } = pair;
    let baud = segment.node_baud(0).unwrap_or(baud);
    let stop = crate::bus::Stop::on_signals()?;
    let served = port::open(name, baud, wiring).and_then(|port| {
        let attached = Attached::new(port, Adapter::new(segment, baud), chatter, baud);
        // Whoever reads it may have gone: the sensors answer all the same.
        let _ = announce([name.to_string().as_str()].into_iter());
        attached.until(&stop)
    });
    match served {
        Ok(()) => Ok(DecodeVerdict::Good),
        Err(error) => {
            Say::new(false).error(&error.message(), &error.next())?;
            Err(Failure::PORT)
        }
    }
}

/// Prints the path of each bus on a line of its own.
fn announce<'a>(paths: impl Iterator<Item = &'a str>) -> io::Result<()> {
    let mut output = io::stdout().lock();
    for path in paths {
        writeln!(output, "{path}")?;
    }
    output.flush()
}
