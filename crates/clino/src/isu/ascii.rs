//! The ISU's ASCII output, line by line: a terminal or a log may have changed the line ends, so that the text decides.

use std::io;

use clino_codec::DecodeProgress;
use clino_codec::ascii::{Centidegrees, LineDecoder, LineFault};
use clino_codec::character::Character;
use serde::ser::{Serialize, SerializeMap as _, Serializer};

use crate::bad::Bad;
use crate::outcome::{DecodeVerdict, Failure};
use crate::stream;

pub fn run() -> Result<DecodeVerdict, Failure> {
    Ok(stream::lines(io::stdin().lock(), io::stdout().lock(), decode)?)
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
