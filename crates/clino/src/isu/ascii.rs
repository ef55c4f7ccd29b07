//! The ISU's ASCII output, line by line: a terminal or a log may have changed the line ends, so that the text decides.

use std::io;
use std::time::Duration;

use clino_bus::Serial;
use clino_codec::DecodeProgress;
use clino_codec::ascii::{Centidegrees, LineDecoder, LineFault};
use clino_codec::character::Character;
use serde::ser::{Serialize, SerializeMap as _, Serializer};

use super::arguments::AsciiLines;
use crate::bad::Bad;
use crate::bus::Stop;
use crate::outcome::{DecodeVerdict, Failure};
use crate::port::{self, PortError, PortName};
use crate::say::Say;
use crate::session::port_failed;
use crate::{report, stream};

/// The longest wait without a look at whether the user wants to stop.
const LOOK: Duration = Duration::from_millis(50);
/// What is longer is no line: they have nine characters.
const LONGEST: usize = 64;

/// Decodes what standard input has, or what a module prints at a port.
pub fn run(AsciiLines { port, lines }: &AsciiLines) -> Result<DecodeVerdict, Failure> {
    match port {
        None => Ok(stream::lines(io::stdin().lock(), io::stdout().lock(), decode)?),
        Some(name) => listen(name, *lines),
    }
}

/// Listens until Ctrl-C, or to that many lines.
fn listen(name: &PortName, most: Option<u32>) -> Result<DecodeVerdict, Failure> {
    let stop = Stop::on_signals()?;
    let failed = |error: &PortError| port_failed(&mut Say::new(false), error);
    let mut port = match port::open(name, Serial::ISU.baud, port::Wiring::default()) {
        Ok(port) => port,
        Err(error) => return Err(failed(&error)?),
    };
    let (mut heard, mut line, mut told) = (Vec::new(), Vec::new(), 0);
    // The first line may have begun before.
    let mut is_whole = false;
    let mut verdict = DecodeVerdict::Good;
    while !stop.is_asked() && most.is_none_or(|most| told < most) {
        if let Err(error) = port.receive(LOOK, &mut heard) {
            return Err(failed(&error)?);
        }
        for character in heard.drain(..) {
            if character.byte != b'\n' {
                line.push(character.byte);
                line.truncate(LONGEST);
                continue;
            }
            if decode(&line).is_ok() || is_whole {
                verdict = verdict.and(report::line(&mut io::stdout().lock(), decode(&line))?);
                told += 1;
            }
            (is_whole, line) = (true, Vec::new());
        }
    }
    Ok(verdict)
}

fn decode(text: &[u8]) -> Result<LineObject, Bad> {
    let text = text.strip_suffix(b"\r").unwrap_or(text);
    if !text.starts_with(b"+") && !text.starts_with(b"-") {
        return Err(Bad::new("no_sign", "a line begins with + or -"));
    }
    let mut decoder = LineDecoder::new();
    for &byte in text.iter().chain(b"\r\n") {
        match decoder.push(Character::clean(byte)) {
            DecodeProgress::More => {}
            DecodeProgress::Frame(angle) => return Ok(LineObject(angle)),
            DecodeProgress::Bad(fault) => return Err(fault.into()),
        }
    }
    // Nine characters end in one way or the other, and a carriage return cannot stand earlier in a line.
    Err(Bad::new("incomplete", "the line is incomplete"))
}

impl From<LineFault> for Bad {
    fn from(fault: LineFault) -> Self {
        let bad = |kind| Self::new(kind, fault);
        match fault {
            LineFault::Unexpected { byte, position } => {
                let character = byte.escape_ascii().to_string();
                // Positions count from 1 in everything that is shown.
                let position = usize::from(position) + 1;
                Self::new("unexpected", format!("'{character}' cannot be character {position} of a line"))
                    .with("character", character.as_str())
                    .with("position", position)
            }
            LineFault::Value { centideg } => bad("value").with("field", "angle_cdeg").with("value", centideg),
            // Text carries no receiver flags.
            LineFault::LineErrors { .. } => bad("line_errors"),
        }
    }
}

struct LineObject(Centidegrees);

impl Serialize for LineObject {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut object = serializer.serialize_map(None)?;
        object.serialize_entry("angle_cdeg", &self.0.get())?;
        object.end()
    }
}
