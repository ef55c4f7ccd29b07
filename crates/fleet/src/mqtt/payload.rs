//! What messages say: JSON, a line each.
//!
//! `ts` is UTC in milliseconds since 1970: of a value when it was measured (reception minus age), of a message when it was
//! made. `seq` counts the messages of a gateway: of two with the same one, the second is a repetition. Its upper 32 bits count
//! the starts of the bridge. `boot` identifies the start of the gateway: power-ups, and starts since.

use std::fmt::Write as _;

use serde_json::to_string;

use crate::clock::Wall;
use crate::hub::{Alarm, GatewayState, Start};
use crate::sensor::Outcome;

/// What stands at the head of every message of a gateway.
#[derive(Clone, Debug)]
pub struct Head {
    /// When it was made.
    pub ts: Wall,
    /// Number of the message.
    pub seq: u64,
    /// Start of the gateway, if it is known.
    pub boot: Option<String>,
}

/// A JSON string.
pub fn quoted(text: &str) -> String {
    to_string(text).unwrap_or_else(|_| "\"\"".into())
}

fn head(head: &Head) -> String {
    let boot = head.boot.as_deref().map_or_else(|| "null".into(), quoted);
    format!("{{\"ts\":{},\"seq\":{},\"boot\":{boot}", head.ts.0, head.seq)
}

/// A number, or null.
fn or_null(value: Option<impl std::fmt::Display>) -> String {
    value.map_or_else(|| "null".into(), |value| value.to_string())
}

/// A value of a batch.
pub fn value(slot: u16, name: Option<&str>, outcome: &Outcome) -> String {
    let mut text = format!("{{\"slot\":{slot},");
    if let Some(name) = name {
        _ = write!(text, "\"name\":{},", quoted(name));
    }
    _ = write!(
        text,
        "\"kind\":{},\"bus\":{},\"address\":{},\"status\":{},\"angle_deg\":{},\"ts\":{},\"outcome\":{},\"health\":[{}]}}",
        quoted(&outcome.kind),
        quoted(&outcome.bus),
        outcome.address,
        quoted(&outcome.status),
        or_null(outcome.value()),
        or_null(outcome.measured.map(|wall| wall.0)),
        outcome.outcome,
        outcome.health.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(",")
    );
    text
}

/// A batch of values.
pub fn state(of: &Head, values: &[String]) -> Vec<u8> {
    format!("{},\"values\":[{}]}}", head(of), values.join(",")).into_bytes()
}

/// Whether the gateway speaks, and its start.
pub fn status(state: &GatewayState, since: Wall) -> Vec<u8> {
    let mut text = format!(
        "{{\"state\":\"{}\",\"since\":{}",
        if state.gone.is_none() { "online" } else { "offline" },
        since.0
    );
    _ = write!(text, ",\"why\":{}", state.gone.as_deref().map_or_else(|| "null".into(), quoted));
    match &state.start {
        Some(start) => _ = write!(text, ",{}", start_members(start)),
        None => text += ",\"boot\":null",
    }
    let signals: Vec<_> = state.signals.iter().map(|word| quoted(word)).collect();
    _ = write!(text, ",\"signals\":[{}]}}", signals.join(","));
    text.into_bytes()
}

fn start_members(start: &Start) -> String {
    format!(
        "\"boot\":{},\"version\":{},\"power_ups\":{},\"boots\":{},\"cause\":{},\"crashes\":{},\"mode\":{},\"uid\":{}",
        quoted(&start.boot()),
        quoted(&start.version),
        start.power_ups,
        start.boots,
        quoted(&start.cause),
        start.crashes,
        quoted(&start.mode),
        quoted(&start.uid)
    )
}

/// An event: what, and its members.
pub fn event(of: &Head, what: &str, members: &str) -> Vec<u8> {
    let comma = if members.is_empty() { "" } else { "," };
    format!("{},\"event\":\"{what}\"{comma}{members}}}", head(of)).into_bytes()
}

/// Members of an event about a start.
pub fn restart(start: &Start) -> String {
    // The head has the boot already.
    start_members(start).split_once(',').map_or_else(String::new, |(_, rest)| rest.to_owned())
}

/// Members of an event about an alarm.
pub fn alarm(alarm: &Alarm) -> String {
    format!(
        "\"slot\":{},\"alarm\":{},\"state\":{},\"extreme\":{},\"unit\":{},\"raised\":{}",
        alarm.slot,
        quoted(&alarm.name),
        quoted(&alarm.state),
        or_null(alarm.extreme),
        or_null(alarm.unit.as_deref().map(quoted)),
        or_null(alarm.raised.map(|wall| wall.0))
    )
}

/// One sensor, for Home Assistant.
pub fn single(outcome: &Outcome) -> Vec<u8> {
    format!(
        "{{\"angle_deg\":{},\"status\":{},\"ts\":{}}}",
        or_null(outcome.value()),
        quoted(&outcome.status),
        or_null(outcome.measured.map(|wall| wall.0))
    )
    .into_bytes()
}

/// Of the bridge itself.
pub fn bridge(is_online: bool) -> Vec<u8> {
    (if is_online { "online" } else { "offline" }).into()
}
