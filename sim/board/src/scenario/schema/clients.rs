//! The gateway's clients: a user at the console, and the master at the Modbus port.

use serde::Deserialize;
use toml::Spanned;

use super::impairments::{Echo, Gap, Impairment};
use crate::modbus::{Framing, Parity};
use crate::scenario::Planned;
use crate::scenario::hex::Hex;
use crate::scenario::units::Time;

/// A line typed at the console.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Typed {
    /// Its first start bit, unless the line before is still being typed.
    pub at: Time,
    /// The line without its end.
    pub line: String,
    /// Pauses in it.
    #[serde(default)]
    pub gaps: Vec<Gap>,
}

impl Typed {
    /// In the terms of a run.
    pub fn planned(&self) -> Planned<'_, str> {
        Planned { at: self.at.0, what: &self.line, gaps: self.gaps.iter().map(Gap::in_line).collect() }
    }
}

/// The console's line.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Console {
    /// The gateway hears what it sends.
    pub echo: Option<Echo>,
    /// What is done to what is typed.
    pub impairment: Vec<Impairment>,
}

/// The master at the Modbus port.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Modbus {
    /// Bit rate in bit/s.
    pub baud: Option<Spanned<u32>>,
    /// Parity bit.
    pub parity: ParityBit,
    /// One or two.
    pub stop_bits: Option<Spanned<u8>>,
    /// What it sends.
    pub request: Vec<Request>,
    /// The gateway hears what it sends.
    pub echo: Option<Echo>,
    /// What is done to what the master sends.
    pub impairment: Vec<Impairment>,
}

/// The bit after the data bits.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ParityBit {
    /// There is none.
    None,
    /// It makes the number of ones even.
    #[default]
    Even,
    /// It makes the number of ones odd.
    Odd,
}

impl Modbus {
    /// In the board's terms.
    pub fn framing(&self) -> Framing {
        let default = Framing::default();
        Framing {
            baud: self.baud.as_ref().map_or(default.baud, |baud| *baud.get_ref()),
            parity: match self.parity {
                ParityBit::None => Parity::None,
                ParityBit::Even => Parity::Even,
                ParityBit::Odd => Parity::Odd,
            },
            stop_bits: self.stop_bits.as_ref().map_or(default.stop_bits, |stop_bits| *stop_bits.get_ref()),
        }
    }
}

/// Something that the master sends.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Request {
    /// Its first start bit, unless the request before is still on its way.
    pub at: Time,
    /// All of it, checksum included.
    pub bytes: Spanned<Hex>,
    /// Pauses in it.
    #[serde(default)]
    pub gaps: Vec<Gap>,
}

impl Request {
    /// In the terms of a run.
    pub fn planned(&self) -> Planned<'_, [u8]> {
        let gaps = self.gaps.iter().map(Gap::in_line).collect();
        Planned { at: self.at.0, what: &self.bytes.get_ref().0, gaps }
    }
}
