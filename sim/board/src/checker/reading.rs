//! Reading lines of the gateway's console: one JSON object a line.

use serde::Deserialize;

/// A reading line as the gateway prints it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Reading {
    /// Number of the slot.
    pub slot: u32,
    /// `t7`, `isu` or `pwm`.
    pub kind: String,
    /// `t7`, `isu`, `pwm1` or `pwm2`.
    pub bus: String,
    /// Address on the bus, 0 for PWM.
    pub address: u8,
    /// `ok` or what is the matter.
    pub status: String,
    /// The angle in degrees when the status is `ok`.
    pub angle_deg: Option<f64>,
    /// Time since the angle was received, in ms; none if there never was one.
    pub age_ms: Option<u64>,
}

/// A reading, or nothing if it is another object.
///
/// # Errors
/// The line is no JSON object, or contradicts itself.
pub fn parse(text: &str) -> Result<Option<Reading>, String> {
    let value: serde_json::Value = serde_json::from_str(text).map_err(|error| error.to_string())?;
    let Some(object) = value.as_object() else { return Err("no JSON object".into()) };
    if !object.contains_key("slot") {
        return Ok(None);
    }
    let reading = Reading::deserialize(&value).map_err(|error| error.to_string())?;
    let ok = reading.status == "ok";
    if ok != reading.angle_deg.is_some() || ok && reading.age_ms.is_none() {
        return Err("an angle and an age exactly when the status is ok".into());
    }
    Ok(Some(reading))
}
