//! The scenario file as it is written. Documented for users in `docs/scenario.md`.

use std::fmt;
use std::num::{NonZeroU32, NonZeroU64};

use clino_sim::motion::Motion;
use clino_sim::{fault, pwm};
use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{self, Deserializer, MapAccess, Visitor};
use toml::Spanned;

use super::hex::Hex;
use super::units::{Chances, Degrees, Deviation, Hertz, Number, Time};
use crate::modbus::{Framing, Parity};
use crate::oscillators::{CrystalLife, HSI_HZ, LSI_HZ, Oscillators};
use crate::plant::{Level, What};

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
    /// What somebody types at the console.
    #[serde(default)]
    pub typed: Vec<Typed>,
    /// The master at the Modbus port.
    #[serde(default)]
    pub modbus: Modbus,
    /// Faults planted into the running firmware.
    #[serde(default)]
    pub plant: Vec<Plant>,
    /// Frequency of the watchdog's oscillator in Hz.
    pub lsi_hz: Option<Spanned<u32>>,
    /// What the crystal does, and the oscillator that stands in for it.
    #[serde(default)]
    pub crystal: Crystal,
}

/// The crystal.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Crystal {
    /// It never starts.
    pub dead: bool,
    /// When it stops.
    pub stops_at: Option<Spanned<Time>>,
    /// When it can swing again.
    pub returns_at: Option<Spanned<Time>>,
    /// Relative error of the internal oscillator.
    pub internal_error: Number<Deviation>,
}

impl File {
    /// The chip's oscillators in the board's terms.
    pub fn oscillators(&self) -> Oscillators {
        let Crystal { dead, stops_at, returns_at, internal_error } = &self.crystal;
        let at = |time: &Option<Spanned<Time>>| time.as_ref().map(|time| time.get_ref().0);
        Oscillators {
            lsi_hz: self.lsi_hz.as_ref().map_or(LSI_HZ, |hz| *hz.get_ref()),
            hsi_hz: HSI_HZ.saturating_add_signed(internal_error.0),
            crystal: CrystalLife {
                stops_at: if *dead { Some(0) } else { at(stops_at) },
                returns_at: at(returns_at),
            },
        }
    }
}

/// A fault planted into the running firmware.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plant {
    /// From when on: it happens when the level executes next.
    pub at: Time,
    /// What it does.
    pub what: Spanned<What>,
    /// Where.
    pub level: Level,
    /// How often.
    #[serde(default = "once")]
    pub times: NonZeroU32,
    /// How long after the reset that it brought it is due again.
    #[serde(default)]
    pub again: Time,
}

fn once() -> NonZeroU32 {
    NonZeroU32::MIN
}

/// A line that somebody types at the console.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Typed {
    /// Its first start bit, unless the line before is still being typed.
    pub at: Time,
    /// The line without its end.
    pub line: String,
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
}

fn default_duration() -> Spanned<Time> {
    Spanned::new(0..0, DEFAULT_DURATION)
}

/// The two RS485 segments.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Segments {
    /// The T7 bus.
    pub t7: Segment,
    /// The ISU bus.
    pub isu: Segment,
}

/// One RS485 segment.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Segment {
    /// The gateway hears itself (RE̅ of its transceiver always on).
    pub echo: bool,
    /// Disturbances for every receiver.
    pub noise: Noise,
    /// When the pair is shorted.
    pub stuck: Vec<Spanned<Stuck>>,
    /// When the gateway's driver cannot be switched off.
    pub de_shorted: Vec<Spanned<Interval>>,
}

/// Disturbances of a segment.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Noise {
    /// Probability that a sampled bit is inverted.
    pub bit_error_rate: Number<Chances>,
    /// Probability that a receiver loses a character.
    pub drop_rate: Number<Chances>,
    /// When; always if it does not say.
    pub within: Option<Spanned<Interval>>,
}

/// From one instant until just before another.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Interval {
    /// First instant.
    pub from: Time,
    /// First instant after.
    pub until: Time,
}

/// An interval of babble.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Babble {
    /// First start bit.
    pub from: Time,
    /// No character begins at or after this.
    pub until: Time,
    /// Pause between two characters; none if it does not say.
    #[serde(default)]
    pub gap: Time,
}

/// How the true angle moves.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Moves {
    /// Not at all: degrees.
    Constant(Number<Degrees>),
    /// At a constant rate.
    Ramp {
        /// Degrees at time 0.
        #[serde(default)]
        start: Number<Degrees>,
        /// Degrees per second.
        rate: Number<Degrees>,
    },
    /// To and fro.
    Sine {
        /// Middle of the swing in degrees.
        #[serde(default)]
        centre: Number<Degrees>,
        /// Half of the swing in degrees.
        amplitude: Number<Degrees>,
        /// One full swing.
        period: Time,
        /// Phase at time 0 in degrees.
        #[serde(default)]
        phase: Number<Degrees>,
    },
    /// Points joined by straight lines.
    Table(Vec<Spanned<Point>>),
}

/// A point of a motion table.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Point {
    /// When.
    pub at: Time,
    /// Where, in degrees.
    pub angle: Number<Degrees>,
}

impl Moves {
    /// The motion in the simulator's terms.
    pub fn motion(&self) -> Motion {
        match self {
            Self::Constant(angle) => Motion::Constant(angle.0),
            Self::Ramp { start, rate } => Motion::Ramp { start: start.0, rate: rate.0 },
            Self::Sine { centre, amplitude, period, phase } => {
                Motion::Sine { centre: centre.0, amplitude: amplitude.0, period: period.0, phase: phase.0 }
            }
            Self::Table(points) => {
                let point = |point: &Spanned<Point>| (point.get_ref().at.0, point.get_ref().angle.0);
                Motion::Table(points.iter().map(point).collect())
            }
        }
    }
}

/// A fixed time (`"2ms"`), or a range that is drawn from evenly (`{ min = "1ms", max = "2ms" }`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Latency {
    /// Shortest.
    pub min: Time,
    /// Longest.
    pub max: Time,
}

impl<'de> Deserialize<'de> for Latency {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Range {
            min: Time,
            max: Time,
        }
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = Latency;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "a duration such as \"2ms\" or {{ min = \"1ms\", max = \"2ms\" }}")
            }

            fn visit_str<E: de::Error>(self, text: &str) -> Result<Latency, E> {
                let time = text.parse().map_err(E::custom)?;
                Ok(Latency { min: time, max: time })
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Latency, A::Error> {
                let Range { min, max } = Range::deserialize(MapAccessDeserializer::new(map))?;
                Ok(Latency { min, max })
            }
        }
        deserializer.deserialize_any(Either)
    }
}

/// A fault of every n-th answer.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fault {
    /// Every how many answers.
    pub every: NonZeroU64,
    /// What happens to it.
    pub what: FaultKind,
}

/// What happens to an answer.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum FaultKind {
    /// Its checksum is inverted.
    BadChecksum,
    /// It does not come.
    Silent,
    /// It comes this much later.
    Late(Time),
    /// Only this many bytes of it come.
    Truncated(usize),
}

impl Fault {
    /// The fault in the simulator's terms.
    pub fn every(&self) -> (u64, fault::Fault) {
        let what = match self.what {
            FaultKind::BadChecksum => fault::Fault::BadChecksum,
            FaultKind::Silent => fault::Fault::Silent,
            FaultKind::Late(by) => fault::Fault::Late(by.0),
            FaultKind::Truncated(length) => fault::Fault::Truncated(length),
        };
        (self.every.get(), what)
    }
}

/// A T7.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct T7 {
    /// Its address.
    pub address: Spanned<u8>,
    /// How it moves.
    pub motion: Moves,
    /// Bit rate in bit/s.
    pub baud: Option<Spanned<u32>>,
    /// End of a Get command to the answer.
    pub latency: Option<Spanned<Latency>>,
    /// How long its driver holds the line after an answer.
    pub hold: Option<Time>,
    /// It answers Get All Angles with the length byte of the document's example.
    #[serde(default)]
    pub length_quirk: bool,
    /// A fault of every n-th answer.
    pub fault: Option<Fault>,
    /// When it is unplugged.
    #[serde(default)]
    pub unplugged: Vec<Spanned<Interval>>,
    /// When it talks out of turn.
    #[serde(default)]
    pub babble: Vec<Spanned<Babble>>,
    /// Probability that a byte of an answer is changed.
    #[serde(default)]
    pub corrupt: Number<Chances>,
    /// Probability that an answer ends early.
    #[serde(default)]
    pub shorten: Number<Chances>,
}

/// An ISU.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Isu {
    /// Its address.
    pub address: Spanned<u8>,
    /// How it moves, relative to its null position.
    pub motion: Moves,
    /// End of a command to its line driver.
    pub latency: Option<Spanned<Latency>>,
    /// How long after the module has begun to run its refresh begins.
    pub phase: Option<Spanned<Time>>,
    /// A fault of every n-th answer.
    pub fault: Option<Fault>,
    /// When it is unplugged.
    #[serde(default)]
    pub unplugged: Vec<Spanned<Interval>>,
    /// When it talks out of turn.
    #[serde(default)]
    pub babble: Vec<Spanned<Babble>>,
    /// Probability that a byte of an answer is changed.
    #[serde(default)]
    pub corrupt: Number<Chances>,
    /// Probability that an answer ends early.
    #[serde(default)]
    pub shorten: Number<Chances>,
}

/// A PWM source.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pwm {
    /// PWM input 1 or 2.
    pub channel: Spanned<u8>,
    /// How the sensor moves, relative to its null position.
    pub motion: Moves,
    /// Frequency in Hz.
    pub frequency: Option<Number<Hertz>>,
    /// How finely the high time is set.
    #[serde(default)]
    pub resolution: Resolution,
    /// When the line stands still.
    #[serde(default)]
    pub stuck: Vec<Spanned<Stuck>>,
}

/// How finely a PWM source sets its high time.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Resolution {
    /// In the 4.34 µs steps of the module.
    #[default]
    Steps,
    /// In nanoseconds.
    Ideal,
}

impl From<Resolution> for pwm::Quantisation {
    fn from(resolution: Resolution) -> Self {
        match resolution {
            Resolution::Steps => Self::Steps,
            Resolution::Ideal => Self::Ideal,
        }
    }
}

/// An interval in which a line stands still.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stuck {
    /// First instant.
    pub from: Time,
    /// First instant after.
    pub until: Time,
    /// Where it stands.
    pub level: StuckLevel,
}

/// Level of a line that stands still.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StuckLevel {
    /// At 0 V.
    Low,
    /// At the supply.
    High,
}
