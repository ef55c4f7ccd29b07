//! A row of the log, as text.

use std::time::{Duration, SystemTime};

use crate::poll::Measured;
use crate::say::thousandths;
use crate::sensors::Sensor;

/// The first line of a file of comma-separated values.
pub const HEADER: &str = "time,kind,address,axis,raw,angle_deg,status,age_ms\n";

/// How rows are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    Csv,
    Jsonl,
}

/// A row.
pub struct Row {
    time: SystemTime,
    sensor: Sensor,
    /// With its age.
    value: Option<(Measured, Duration)>,
    status: &'static str,
}

impl Row {
    /// With a value that was received at `time`.
    pub fn with(
        time: SystemTime,
        age: Duration,
        sensor: &Sensor,
        value: Measured,
        status: &'static str,
    ) -> Self {
        Self { time, sensor: *sensor, value: Some((value, age)), status }
    }

    /// Without one.
    pub fn without(time: SystemTime, sensor: &Sensor, status: &'static str) -> Self {
        Self { time, sensor: *sensor, value: None, status }
    }

    /// As a line with its end.
    pub fn text(&self, form: Form) -> String {
        let time = humantime::format_rfc3339_micros(self.time);
        let Self { sensor: Sensor { kind, address, axis }, status, .. } = self;
        let kind = kind.name();
        let none = if form == Form::Csv { "" } else { "null" };
        let or_none = |text: Option<String>| text.unwrap_or_else(|| none.to_owned());
        let axis = or_none(axis.map(|axis| axis.to_string()));
        let raw = or_none(self.value.map(|(value, _)| value.raw.to_string()));
        let angle = or_none(self.value.map(|(value, _)| thousandths(value.mdeg).to_string()));
        let age = or_none(self.value.map(|(_, age)| age.as_millis().to_string()));
        match form {
            Form::Csv => format!("{time},{kind},{address},{axis},{raw},{angle},{status},{age}\n"),
            Form::Jsonl => format!(
                "{{\"time\":\"{time}\",\"kind\":\"{kind}\",\"address\":{address},\"axis\":{axis},\"raw\":{raw},\
                 \"angle_deg\":{angle},\"status\":\"{status}\",\"age_ms\":{age}}}\n"
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensors::Kind;

    #[test]
    fn columns_are_fixed_and_empty_where_there_is_no_value() {
        let time = SystemTime::UNIX_EPOCH + Duration::from_micros(1_795_989_139_123_456);
        let t7 = Sensor { kind: Kind::T7, address: 5, axis: Some(2) };
        let isu = Sensor { kind: Kind::Isu, address: 3, axis: None };
        let value = Measured { raw: -255, mdeg: -255 };
        let with = Row::with(time, Duration::from_micros(7_900), &t7, value, "ok");
        assert_eq!(with.text(Form::Csv), "2026-11-29T21:52:19.123456Z,t7,5,2,-255,-0.255,ok,7\n");
        let without = Row::without(time, &isu, "no_answer");
        assert_eq!(without.text(Form::Csv), "2026-11-29T21:52:19.123456Z,isu,3,,,,no_answer,\n");
        let columns = HEADER.matches(',').count();
        for row in [&with, &without] {
            assert_eq!(row.text(Form::Csv).matches(',').count(), columns);
            let object: serde_json::Value = serde_json::from_str(&row.text(Form::Jsonl)).unwrap();
            let names: Vec<&str> = HEADER.trim().split(',').collect();
            assert!(names.iter().all(|name| object.get(name).is_some()), "{object}");
        }
        assert!(
            without
                .text(Form::Jsonl)
                .contains(r#""raw":null,"angle_deg":null,"status":"no_answer","age_ms":null}"#)
        );
    }
}
