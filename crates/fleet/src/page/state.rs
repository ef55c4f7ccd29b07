//! The state as the page gets it, and the memory of its plots.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use clino_codec::angle::Angle;
use serde_json::{Value, json};

use crate::history::{History, Span};
use crate::hub::{GatewayState, Hub, News, Told};
use crate::sensor::Outcome;

/// Sensors that are remembered: 48 of each of ten gateways, 45 MB. Further ones have no plot.
const REMEMBERED: usize = 480;
/// The small plots show a minute, a point a second.
const SMALL: Duration = Duration::from_secs(60);
const SMALL_POINT: Duration = Duration::from_secs(1);

/// The memory of the plots.
pub struct Memory {
    sensors: Mutex<BTreeMap<(usize, u16), History>>,
}

impl Memory {
    pub fn new() -> Memory {
        Memory { sensors: Mutex::new(BTreeMap::new()) }
    }

    /// Remembers an angle, if that is what the news is.
    pub fn note(&self, news: &News) {
        let Told::Outcome(slot, outcome) = &news.told else { return };
        let Some((angle, measured)) = outcome.value().zip(outcome.measured_at) else { return };
        let mut sensors = self.sensors.lock().unwrap_or_else(PoisonError::into_inner);
        if sensors.len() < REMEMBERED || sensors.contains_key(&(news.gateway, *slot)) {
            let history = sensors.entry((news.gateway, *slot)).or_insert_with(|| History::new(measured));
            history.add(measured, angle);
        }
    }

    /// The last `span` of a sensor.
    pub fn last(&self, gateway: usize, slot: u16, span: Duration, now: Instant) -> Option<Span> {
        let mut sensors = self.sensors.lock().unwrap_or_else(PoisonError::into_inner);
        Some(sensors.get_mut(&(gateway, slot))?.last(span, now))
    }

    /// A point a second of the last minute, in millidegrees.
    fn small(&self, gateway: usize, slot: u16, now: Instant) -> Vec<Option<i32>> {
        let Some(span) = self.last(gateway, slot, SMALL, now) else { return Vec::new() };
        // Of a sensor that is new there are fewer points, not points that are closer together.
        let each = SMALL_POINT.as_millis() / span.interval.as_millis().max(1);
        let each = usize::try_from(each).unwrap_or(usize::MAX).max(1);
        span.extents
            .chunks(each)
            .map(|points| points.iter().rev().flatten().next().map(|(_, high)| high.mdeg()))
            .collect()
    }
}

/// A sensor.
pub fn sensor(gateway: &GatewayState, slot: u16, outcome: &Outcome, now: Instant) -> Value {
    let alarms: Vec<_> = gateway
        .alarms
        .values()
        .filter(|alarm| alarm.slot == slot)
        .map(|alarm| json!({ "name": &*alarm.name, "state": &*alarm.state }))
        .collect();
    json!({
        "slot": slot,
        "name": gateway.config.sensor(slot),
        "kind": &*outcome.kind,
        "bus": &*outcome.bus,
        "address": outcome.address,
        "status": &*outcome.status,
        "angle_mdeg": outcome.value().map(Angle::mdeg),
        "age_ms": outcome.age_ms(now),
        "health": outcome.health.iter().map(|word| &**word).collect::<Vec<_>>(),
        "alarms": alarms,
    })
}

/// A gateway without its sensors.
pub fn gateway(state: &GatewayState) -> Value {
    let buses: Vec<_> = state
        .buses
        .iter()
        .map(|((bus, kind), values)| json!({ "bus": &**bus, "kind": &**kind, "values": values }))
        .collect();
    json!({
        "name": state.config.name.as_str(),
        "gone": state.gone,
        "signals": state.signals.iter().map(|word| &**word).collect::<Vec<_>>(),
        "start": state.start.as_ref().map(|start| json!({
            "boot": start.boot(), "version": start.version, "cause": start.cause, "crashes": start.crashes, "mode": start.mode,
        })),
        "restarts": state.restarts,
        "buses": buses,
    })
}

/// Everything.
pub fn whole(hub: &Hub, memory: &Memory, allows_writes: bool) -> Value {
    let now = Instant::now();
    let gateways: Vec<_> = (0..hub.len())
        .filter_map(|number| {
            let state = hub.gateway(number)?;
            let mut whole = gateway(&state);
            let sensors: Vec<_> = state
                .sensors
                .iter()
                .map(|(slot, outcome)| {
                    let mut sensor = sensor(&state, *slot, outcome, now);
                    if let Some(members) = sensor.as_object_mut() {
                        members.insert("minute".into(), json!(memory.small(number, *slot, now)));
                    }
                    sensor
                })
                .collect();
            whole.as_object_mut()?.insert("sensors".into(), Value::Array(sensors));
            Some(whole)
        })
        .collect();
    json!({ "allows_writes": allows_writes, "gateways": gateways })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_plot_has_a_point_a_second_from_the_first_second_on() {
        let (memory, since) = (Memory::new(), Instant::now());
        let mut history = History::new(since);
        let after = |tenths: u32| since + Duration::from_millis(100) * tenths;
        for (tenths, points) in [(5, 1), (25, 3), (595, 60), (1_195, 60)] {
            for tenth in 0..=tenths {
                history
                    .add(after(tenth), Angle::from_mdeg(i32::try_from(tenth).expect("few")).expect("a turn"));
            }
            memory.sensors.lock().expect("no panic").insert((0, 0), history);
            let small = memory.small(0, 0, after(tenths));
            assert_eq!((small.len(), small.last().copied().flatten()), (points, i32::try_from(tenths).ok()));
            history = memory.sensors.lock().expect("no panic").remove(&(0, 0)).expect("it was put there");
        }
    }
}
