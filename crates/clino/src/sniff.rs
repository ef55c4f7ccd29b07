//! `clino sniff`: listens on a pair, sends nothing, and tells what both sides say.
//!
//! ```text
//!     1.250000 -> 05 01 83                 address 5, command get_angle, axis 2
//!     1.252260 <- 05 06 83 00 00 30 39 09  address 5, command get_angle, axis 2, angle_mdeg 12345, after_us 2000
//!     1.300000 !! 05 06 83 00              incomplete: …
//! ```
//! `->` is a command, `<-` an answer, `!!` what is neither. Times are in seconds, of the first byte: since the start, or as the
//! capture has them. At a port a byte is stamped when it is read, which is up to the latency of the port later than it was on
//! the pair; a capture is as exact as it is.

mod capture;
mod frames;
mod listing;

use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::Args;
use clino_bus::{Serial, Timing};
use clino_codec::character::Character;
use clino_codec::t7::BaudRate;

use crate::bus::{Asked, Diagnosis, Make, Stop};
use crate::number::within;
use crate::outcome::{DecodeVerdict, Failure};
use crate::port;
use crate::say::Say;
use crate::sensors::Kind;
use crate::session::port_failed;
use crate::t7;
use frames::{Frames, Item, Stamped, What};

/// The longest wait without a look at whether the user wants to stop.
const LOOK: Duration = Duration::from_millis(50);
/// Characters without one good frame, after which the probable cause is told.
const SUSPICIOUS: usize = 40;
/// Characters of a frame that are never further apart in a capture, besides what `--gap` says.
const GAP_MS: u64 = 2_000;

/// `clino sniff`
#[derive(Args)]
pub struct Arguments {
    /// What is on the bus
    #[arg(value_name = "t7|isu", hide_possible_values = true)]
    kind: Kind,
    /// Decode a capture instead of listening: lines of `SECONDS BYTES`, a bus log of the virtual board, or sigrok's UART export;
    /// - is standard input
    #[arg(long, value_name = "FILE", conflicts_with = "port", required_unless_present = "port")]
    from: Option<PathBuf>,
    /// Sample rate of a capture whose times are sample numbers, in Hz
    #[arg(long, value_name = "HZ", requires = "from", value_parser = rate)]
    samplerate: Option<u64>,
    /// Bit rate of a T7 bus
    #[arg(long, value_name = "RATE", value_parser = t7::baud)]
    baud: Option<BaudRate>,
    /// Longest pause within a frame, in ms, instead of what is known of the port
    #[arg(long, value_name = "MS", value_parser = gap)]
    gap: Option<u64>,
    /// Serial port, pseudo-terminal, or tcp://host:port
    #[arg(long, value_name = "PORT")]
    port: Option<port::PortName>,
    /// One JSON object per line
    #[arg(long)]
    json: bool,
}

/// Listens until Ctrl-C, or to the end of the capture.
pub fn run(arguments: Arguments) -> Result<DecodeVerdict, Failure> {
    let serial = match (arguments.kind, arguments.baud) {
        (Kind::T7, baud) => Serial { baud: baud.unwrap_or(BaudRate::B115200).bits_per_second() },
        (Kind::Isu, None) => Serial::ISU,
        (Kind::Isu, Some(_)) => {
            return Err(Failure::Usage("an ISU bus has 9600 bit/s: leave --baud out".to_owned()));
        }
    };
    let timing = match arguments.kind {
        Kind::T7 => Timing::t7(serial),
        Kind::Isu => Timing::isu(),
    };
    let character_us = u64::from(serial.characters(1).as_micros());
    // The gap of the bus's own master, which is measured from character to character.
    let gap_us = u64::from(timing.gap.as_micros()) + character_us;
    let mut say = Say::new(arguments.json);
    let mut verdict = DecodeVerdict::Good;
    if let Some(path) = &arguments.from {
        let gap_us = arguments.gap.map_or(gap_us, |ms| ms * 1_000);
        let settings =
            capture::Settings { kind: arguments.kind, samplerate: arguments.samplerate, character_us };
        let characters = capture::read(path, &settings).map_err(|why| Failure::Usage(why.to_string()))?;
        let mut frames = Frames::new(arguments.kind, gap_us, character_us);
        let mut items = Vec::new();
        characters.into_iter().for_each(|character| frames.take(character, &mut items));
        frames.end(&mut items);
        for item in &items {
            verdict = verdict.and(tell(&mut say, item)?);
        }
        return Ok(verdict);
    }
    let Some(name) = arguments.port else { return Ok(verdict) };
    listen(&mut say, arguments.kind, &name, serial, arguments.gap, gap_us, character_us)
}

fn listen(
    say: &mut Say,
    kind: Kind,
    name: &port::PortName,
    serial: Serial,
    gap: Option<u64>,
    gap_us: u64,
    character_us: u64,
) -> Result<DecodeVerdict, Failure> {
    let stop = Stop::on_signals()?;
    let mut port = match port::open(name, serial.baud, port::Wiring::default()) {
        Ok(port) => port,
        Err(error) => return Err(port_failed(say, &error)?),
    };
    // A batch may end anywhere in a frame.
    let batch_us = u64::try_from(port.latency().as_micros()).unwrap_or(GAP_MS);
    let gap_us = gap.map_or(gap_us + batch_us, |ms| ms * 1_000);
    let mut frames = Frames::new(kind, gap_us, character_us);
    let start = Instant::now();
    let now = || u64::try_from(start.elapsed().as_micros()).unwrap_or(u64::MAX);
    let (mut heard, mut items, mut doubts) = (Vec::new(), Vec::new(), Doubts::default());
    let mut verdict = DecodeVerdict::Good;
    while !stop.is_asked() {
        if let Err(error) = port.receive(LOOK, &mut heard) {
            return Err(port_failed(say, &error)?);
        }
        let at_us = now();
        for character in heard.drain(..) {
            doubts.heard(&character);
            frames.take(
                Stamped { at_us, byte: character.byte, is_flawed: !character.errors.is_none() },
                &mut items,
            );
        }
        frames.pause(at_us, &mut items);
        for item in items.drain(..) {
            doubts.told(&item);
            verdict = verdict.and(tell(say, &item)?);
        }
        if let Some(diagnosis) = doubts.diagnosis(kind) {
            say.diagnosis(&diagnosis)?;
        }
    }
    frames.end(&mut items);
    for item in &items {
        verdict = verdict.and(tell(say, item)?);
    }
    Ok(verdict)
}

/// What was heard before the first good frame.
#[derive(Default)]
struct Doubts {
    characters: usize,
    flawed: usize,
    /// Zeros without a stop bit: the line is low.
    breaks: usize,
    /// A frame was good, or the cause was told.
    is_settled: bool,
}

impl Doubts {
    fn heard(&mut self, character: &Character) {
        self.characters += 1;
        if !character.errors.is_none() {
            self.flawed += 1;
            self.breaks += usize::from(character.byte == 0);
        }
    }

    fn told(&mut self, item: &Item) {
        self.is_settled |= matches!(item.what, What::Command { .. } | What::Answer { .. });
    }

    /// Told once.
    fn diagnosis(&mut self, kind: Kind) -> Option<Diagnosis> {
        if self.is_settled || self.characters < SUSPICIOUS {
            return None;
        }
        self.is_settled = true;
        let make = match kind {
            Kind::T7 => Make::T7,
            Kind::Isu => Make::Isu,
        };
        Some(crate::bus::overheard(make, Asked::Scan, self.characters, self.flawed, self.breaks))
    }
}

/// Tells an item; whether it is good.
fn tell(say: &mut Say, item: &Item) -> Result<DecodeVerdict, Failure> {
    let text = if say.is_for_programs() { listing::object(item) } else { listing::line(item) };
    say.print(&text)?;
    Ok(match item.what {
        What::Command { .. } | What::Answer { .. } => DecodeVerdict::Good,
        What::Bad { .. } | What::Unanswered => DecodeVerdict::Bad,
    })
}

fn gap(text: &str) -> Result<u64, String> {
    within(text, 1..=GAP_MS)
}

fn rate(text: &str) -> Result<u64, String> {
    within(text, 1..=10_000_000_000)
}
