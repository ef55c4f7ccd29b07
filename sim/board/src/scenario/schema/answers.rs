//! How a node answers: the latency, and the faults of every n-th answer.

use std::fmt;
use std::num::NonZeroU64;

use clino_sim::fault;
use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{self, Deserializer, MapAccess, Visitor};

use crate::scenario::units::Time;

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
    pub fn every(&self) -> (u64, fault::AnswerFault) {
        let what = match self.what {
            FaultKind::BadChecksum => fault::AnswerFault::BadChecksum,
            FaultKind::Silent => fault::AnswerFault::Silent,
            FaultKind::Late(by) => fault::AnswerFault::Late(by.0),
            FaultKind::Truncated(length) => fault::AnswerFault::Truncated(length),
        };
        (self.every.get(), what)
    }
}
