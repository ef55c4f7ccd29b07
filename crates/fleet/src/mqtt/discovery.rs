//! Discovery by Home Assistant: one device for each gateway, one entity for each sensor.
//!
//! Source: Home Assistant, *MQTT*, sections *MQTT discovery* (device discovery) and *Sensor* (`expire_after`,
//! `availability_mode`). An entity expires after three periods without a value; it is available while the bridge and the
//! gateway are.

use serde_json::{Map, Value, json};

use crate::config::{HomeAssistant, Mqtt};
use crate::hub::GatewayState;
use crate::store::Message;

/// Periods without a value after which an entity expires.
const PERIODS: u32 = 3;

/// Topic of the values of one sensor.
pub fn value_topic(mqtt: &Mqtt, gateway: &str, slot: u16) -> String {
    format!("{}/{gateway}/{slot}/value", mqtt.prefix)
}

/// The retained message that describes a gateway with the sensors that are known of it.
pub fn device(mqtt: &Mqtt, home: &HomeAssistant, state: &GatewayState) -> Message {
    let name = state.config.name.as_str();
    let identity = format!("{}_{name}", mqtt.prefix);
    let mut components = Map::new();
    for (slot, outcome) in &state.sensors {
        let usual = format!("{} {}", outcome.bus.to_uppercase(), outcome.address);
        let label = state.config.sensor(*slot).map_or(usual, str::to_owned);
        let seconds = u64::from(home.every_ms.saturating_mul(PERIODS)).div_ceil(1_000).max(1);
        components.insert(
            format!("angle_{slot}"),
            json!({
                "platform": "sensor",
                "unique_id": format!("{identity}_{slot}_angle"),
                "name": label,
                "state_topic": value_topic(mqtt, name, *slot),
                // `None` is Home Assistant's word for a state that is not known.
                "value_template": "{{ value_json.angle_deg }}",
                "json_attributes_topic": value_topic(mqtt, name, *slot),
                "unit_of_measurement": "°",
                "suggested_display_precision": 3,
                "state_class": "measurement",
                "icon": "mdi:angle-acute",
                "expire_after": seconds,
            }),
        );
    }
    let version = state.start.as_ref().map(|start| start.version.clone());
    let mut device = json!({
        "identifiers": [identity],
        "name": name,
        "manufacturer": "clino",
        "model": "Inclinometer gateway",
    });
    if let (Some(device), Some(version)) = (device.as_object_mut(), version) {
        device.insert("sw_version".into(), Value::String(version));
    }
    let payload = json!({
        "device": device,
        "origin": { "name": "clino", "sw_version": env!("CARGO_PKG_VERSION") },
        "components": components,
        "availability": [
            { "topic": format!("{}/bridge/{}/status", mqtt.prefix, mqtt.bridge) },
            { "topic": format!("{}/{name}/status", mqtt.prefix), "value_template": "{{ value_json.state }}" },
        ],
        "availability_mode": "all",
        "qos": 1,
    });
    let topic = format!("{}/device/{identity}/config", home.prefix).replace('.', "_");
    Message { topic, payload: payload.to_string().into_bytes(), retain: true }
}
