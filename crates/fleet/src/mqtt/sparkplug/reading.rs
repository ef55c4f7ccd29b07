//! A reading of a device, as it waits for the broker and as it is sent.
//!
//! What waits is a [`Record`], protobuf of our own: which metrics a host gets of it depends on the connection on which it is
//! sent.

use prost::Message as _;

use super::message::{Metric, PropertySet, PropertyValue, Value, datatype};
use crate::clock::Wall;
use crate::sensor::{Outcome, SOURCE_GONE};

/// Readings of a gateway that came close to each other.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Record {
    /// In the order in which they came.
    #[prost(message, repeated, tag = "1")]
    pub readings: Vec<Reading>,
}

/// A reading of a slot.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Reading {
    /// The slot.
    #[prost(uint32, tag = "1")]
    pub slot: u32,
    /// Bus and address.
    #[prost(string, tag = "2")]
    pub place: String,
    /// `ok`, or why there is no angle, in the gateway's words.
    #[prost(string, tag = "3")]
    pub status: String,
    /// The angle in millidegrees, if it is right and fresh.
    #[prost(sint32, optional, tag = "4")]
    pub mdeg: Option<i32>,
    /// When the angle was measured, or, without one, when that was told: milliseconds since 1970.
    #[prost(uint64, tag = "5")]
    pub at: u64,
}

impl Record {
    /// From disk; one that is damaged is empty.
    pub fn read(bytes: &[u8]) -> Record {
        Record::decode(bytes).unwrap_or_default()
    }
}

impl Reading {
    /// What was told at this time.
    pub fn of(slot: u16, outcome: &Outcome, told: Wall) -> Reading {
        let value = outcome.value();
        let measured = outcome.measured.filter(|_| value.is_some());
        Reading {
            slot: slot.into(),
            place: format!("{} {}", outcome.bus, outcome.address),
            status: outcome.status.to_string(),
            mdeg: value.map(|angle| angle.mdeg()),
            at: u64::try_from(measured.unwrap_or(told).0).unwrap_or_default(),
        }
    }

    /// The same device without a source.
    pub fn gone(&self) -> Reading {
        Reading { status: SOURCE_GONE.to_owned(), mdeg: None, ..self.clone() }
    }

    /// Its status, and its angle, which is null unless it is right and fresh.
    pub fn metrics(&self, is_historical: bool) -> Vec<Metric> {
        let angle = self.mdeg.map(|mdeg| Value::Double(f64::from(mdeg) / MDEG_PER_DEG));
        let status = Value::Text(self.status.clone());
        let mut metrics = vec![
            metric("Status", datatype::STRING, Some(status), self.at),
            metric("Angle", datatype::DOUBLE, angle, self.at),
        ];
        if is_historical {
            metrics.iter_mut().for_each(|metric| metric.is_historical = Some(true));
        }
        metrics
    }

    /// The same with what a host learns of a device at its birth.
    pub fn birth(&self, name: Option<&str>) -> Vec<Metric> {
        let mut metrics = self.metrics(false);
        if let Some(angle) = metrics.last_mut() {
            angle.properties = Some(PropertySet {
                keys: vec!["engUnit".into()],
                values: vec![PropertyValue { datatype: Some(datatype::STRING), text: Some("deg".into()) }],
            });
        }
        let name = name.map_or_else(|| format!("slot {}", self.slot), str::to_owned);
        for (property, text) in [("Properties/Place", self.place.clone()), ("Properties/Name", name)] {
            metrics.push(metric(property, datatype::STRING, Some(Value::Text(text)), self.at));
        }
        metrics
    }
}

const MDEG_PER_DEG: f64 = 1_000.0;

/// A metric of that time; without a value it is null.
pub fn metric(name: &str, datatype: u32, value: Option<Value>, timestamp: u64) -> Metric {
    Metric {
        name: Some(name.to_owned()),
        timestamp: Some(timestamp),
        datatype: Some(datatype),
        is_historical: None,
        is_null: value.is_none().then_some(true),
        properties: None,
        value,
    }
}
