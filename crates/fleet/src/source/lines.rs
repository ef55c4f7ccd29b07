//! Lines of a gateway's console. Source: `docs/console.md`, *The stream*; `docs/alarms.md`.
//!
//! A line that is no whole JSON object, or lacks a member, tells nothing: it is counted. A status that is not known survives
//! as it is.

use std::sync::Arc;
use std::time::Instant;

use clino_codec::angle::Angle;
use serde_json::{Map, Value};

use crate::clock::Wall;
use crate::hub::{Alarm, BusLine, Start, Told};
use crate::sensor::{OK, Outcome, TURN_MDEG};

/// What a line says.
#[derive(Debug)]
pub enum Line {
    /// Something for the hub.
    Told(Told),
    /// A start, of which [`Line::Cause`] tells more.
    Start(Start),
    /// Cause of the start, and how many starts before ended in a crash.
    Cause(String, u32),
    /// An object that is no part of the stream: of the answer to a command.
    Answer(Value),
    /// No line of a gateway.
    Foreign,
}

/// Reads a line that was received at this instant.
pub fn read(text: &str, at: Instant, wall: Wall) -> Line {
    let Ok(Value::Object(object)) = serde_json::from_str(text) else { return Line::Foreign };
    let told = if object.contains_key("slot") && object.contains_key("seq") {
        outcome(&object, at, wall)
    } else if object.contains_key("alarm") && object.contains_key("state") {
        alarm(&object, wall)
    } else if object.contains_key("summary") {
        words(&object, "summary").map(Told::Summary)
    } else if text_of(&object, "stream") == Some("started") || text_of(&object, "what") == Some("clino") {
        return start(&object).map_or(Line::Foreign, Line::Start);
    } else if text_of(&object, "what") == Some("start") {
        let cause = text_of(&object, "cause").zip(number(&object, "crashes"));
        return cause.map_or(Line::Foreign, |(cause, crashes)| Line::Cause(cause.to_owned(), crashes));
    } else if let Some(kind) =
        ["stats", "line", "times", "bus_fault"].into_iter().find(|kind| object.contains_key(*kind))
    {
        bus_line(&object, kind)
    } else {
        return Line::Answer(Value::Object(object));
    };
    told.map_or(Line::Foreign, Line::Told)
}

fn text_of<'a>(object: &'a Map<String, Value>, key: &str) -> Option<&'a str> {
    object.get(key)?.as_str()
}

fn words(object: &Map<String, Value>, key: &str) -> Option<Vec<Arc<str>>> {
    object.get(key)?.as_array()?.iter().map(|word| word.as_str().map(Arc::from)).collect()
}

fn number<T: TryFrom<u64>>(object: &Map<String, Value>, key: &str) -> Option<T> {
    object.get(key)?.as_u64()?.try_into().ok()
}

/// `null`, or a number: `None` if it is neither.
#[expect(clippy::option_option, reason = "absent and null are two things")]
fn nullable<T: TryFrom<u64>>(object: &Map<String, Value>, key: &str) -> Option<Option<T>> {
    match object.get(key)? {
        Value::Null => Some(None),
        _ => number(object, key).map(Some),
    }
}

fn outcome(object: &Map<String, Value>, at: Instant, wall: Wall) -> Option<Told> {
    let status = text_of(object, "status")?;
    let age_ms: Option<u64> = nullable(object, "age_ms")?;
    let angle = match object.get("angle_deg")? {
        Value::Null => None,
        value => Some(angle_of(&value.to_string())?),
    };
    // The gateway never sends one without the other; a line that does is damaged.
    if angle.is_some() != (status == OK) || (angle.is_some() && age_ms.is_none()) {
        return None;
    }
    let outcome = Outcome {
        kind: text_of(object, "kind")?.into(),
        bus: text_of(object, "bus")?.into(),
        address: number(object, "address")?,
        status: status.into(),
        angle,
        measured: age_ms.map(|ms| wall.minus_ms(ms)),
        measured_at: age_ms.and_then(|ms| at.checked_sub(std::time::Duration::from_millis(ms))),
        health: words(object, "health")?,
        outcome: number(object, "seq")?,
    };
    Some(Told::Outcome(number(object, "slot")?, outcome))
}

/// The angle of a number with up to three decimals, as the gateway writes it. Without floating point, so that nothing is
/// rounded.
fn angle_of(text: &str) -> Option<Angle> {
    let (sign, magnitude) = text.strip_prefix('-').map_or((1, text), |rest| (-1, rest));
    let (whole, decimals) = magnitude.split_once('.').unwrap_or((magnitude, ""));
    let is_number = |digits: &str| digits.bytes().all(|digit| digit.is_ascii_digit());
    if whole.is_empty() || whole.len() > 3 || decimals.len() > 3 || !is_number(whole) || !is_number(decimals)
    {
        return None;
    }
    let thousandths: i32 = format!("{decimals:0<3}").parse().ok()?;
    let mdeg = whole.parse::<i32>().ok()? * 1_000 + thousandths;
    (mdeg < TURN_MDEG).then_some(sign * mdeg).and_then(Angle::from_mdeg)
}

fn alarm(object: &Map<String, Value>, wall: Wall) -> Option<Told> {
    let age_ms: Option<u64> = object.get("age_ms").and_then(Value::as_u64);
    Some(Told::Alarm(Alarm {
        slot: number(object, "alarm")?,
        name: text_of(object, "name")?.into(),
        state: text_of(object, "state")?.into(),
        extreme: object.get("extreme").and_then(Value::as_f64),
        unit: text_of(object, "unit").map(Arc::from),
        raised: age_ms.map(|ms| wall.minus_ms(ms)),
    }))
}

fn start(object: &Map<String, Value>) -> Option<Start> {
    let text = |key| text_of(object, key).map(str::to_owned);
    Some(Start {
        version: text("version")?,
        power_ups: number(object, "power_ups")?,
        boots: number(object, "boots")?,
        uid: text("uid")?,
        mode: text("mode")?,
        cause: String::new(),
        crashes: 0,
    })
}

fn bus_line(object: &Map<String, Value>, kind: &str) -> Option<Told> {
    let bus = text_of(object, kind)?.into();
    let mut values = object.clone();
    values.remove(kind);
    Some(Told::Bus(BusLine { bus, kind: kind.into(), values }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(text: &str) -> Option<Told> {
        match read(text, Instant::now(), Wall(1_000_000)) {
            Line::Told(told) => Some(told),
            _ => None,
        }
    }

    /// Lines as `docs/console.md` has them.
    #[test]
    fn a_reading_is_measured_before_it_is_received() {
        let line = r#"{"slot":0,"kind":"t7","bus":"t7","address":1,"status":"ok","angle_deg":-12.345,"age_ms":2000,"health":[],"seq":1}"#;
        let Some(Told::Outcome(0, outcome)) = told(line) else { panic!("{line}") };
        assert_eq!(outcome.value(), Angle::from_mdeg(-12_345));
        assert_eq!(outcome.measured, Some(Wall(998_000)));
        let line = r#"{"slot":1,"kind":"t7","bus":"t7","address":2,"status":"no_answer","angle_deg":null,"age_ms":null,"health":[],"seq":1}"#;
        let Some(Told::Outcome(1, outcome)) = told(line) else { panic!("{line}") };
        assert_eq!((outcome.value(), outcome.measured), (None, None));
    }

    #[test]
    fn a_damaged_reading_tells_nothing() {
        let good = r#"{"slot":0,"kind":"t7","bus":"t7","address":1,"status":"ok","angle_deg":12.345,"age_ms":2,"health":[],"seq":1}"#;
        assert!(told(good).is_some());
        for (from, to) in [
            (r#""status":"ok""#, r#""status":"stale""#),
            ("12.345", "null"),
            ("12.345", "12.3456"),
            ("12.345", "1234.5"),
            ("12.345", "360.000"),
            ("12.345", "1e3"),
            ("12.345", r#""12.345""#),
            (r#""age_ms":2"#, r#""age_ms":null"#),
            (r#""age_ms":2"#, r#""age_ms":-2"#),
            (r#""address":1"#, r#""address":256"#),
            (r#""slot":0"#, r#""slot":-1"#),
            (r#","seq":1}"#, ""),
            (r#""health":[]"#, r#""health":[1]"#),
        ] {
            let bad = good.replace(from, to);
            assert_ne!(bad, good);
            assert!(told(&bad).is_none(), "{bad}");
        }
        for cut in 1..good.len() {
            assert!(told(&good[cut..]).is_none() && told(&good[..cut]).is_none(), "{cut}");
        }
    }

    #[test]
    fn every_angle_of_a_gateway_is_read_exactly() {
        for mdeg_expected in (-359_999_i32..360_000).step_by(7).chain([0, -1, 1, 999, 1_000, -180_000]) {
            let (sign, magnitude) = (if mdeg_expected < 0 { "-" } else { "" }, mdeg_expected.unsigned_abs());
            let text = format!("{sign}{}.{:03}", magnitude / 1_000, magnitude % 1_000);
            assert_eq!(angle_of(&text), Angle::from_mdeg(mdeg_expected), "{text}");
        }
        for text in ["", "-", ".5", "1.", "--1", "1.2.3", "+1", "1 ", "０"] {
            assert!(angle_of(text).is_none_or(|_| text == "1."), "{text}");
        }
    }

    #[test]
    fn starts_alarms_and_health_are_read() {
        let line = r#"{"stream":"started","version":"0.1.0","uptime_ms":5,"mode":"normal","clock":"crystal","power_ups":3,"boots":2,"uid":"f2","prompt":"x"}"#;
        let Line::Start(start) = read(line, Instant::now(), Wall(0)) else { panic!("{line}") };
        assert_eq!(start.boot(), "3.2");
        let line = r#"{"alarm":0,"name":"high","state":"active","age_ms":7,"extreme":12.345,"unit":"deg","angle_deg":12.345}"#;
        let Some(Told::Alarm(alarm)) = told(line) else { panic!("{line}") };
        assert_eq!((alarm.raised, alarm.extreme), (Some(Wall(999_993)), Some(12.345)));
        let line = r#"{"stats":"t7","requests":139,"good":106}"#;
        let Some(Told::Bus(line)) = told(line) else { panic!("{line}") };
        assert_eq!((&*line.bus, &*line.kind, line.values["good"].as_u64()), ("t7", "stats", Some(106)));
        let line =
            r#"{"what":"start","cause":"power_on","boots":1,"crashes":2,"mode":"normal","clock":"crystal"}"#;
        assert!(matches!(read(line, Instant::now(), Wall(0)), Line::Cause(cause, 2) if cause == "power_on"));
        assert!(matches!(read(r#"{"done":true}"#, Instant::now(), Wall(0)), Line::Answer(_)));
        assert!(matches!(read("clino> ", Instant::now(), Wall(0)), Line::Foreign));
    }
}
