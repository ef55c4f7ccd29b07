//! An answer of a T7 as one flat JSON object.

use clino_codec::t7::{Answer, DeviceInformation, Response, Status, Temperature, Text};
use serde::ser::{Serialize, SerializeMap, Serializer};

use super::names;

/// An answer to be shown.
pub struct AnswerObject(pub Answer);

impl Serialize for AnswerObject {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Answer { address, response, length_quirk } = &self.0;
        let mut object = serializer.serialize_map(None)?;
        object.serialize_entry("address", &address.get())?;
        object.serialize_entry("command", names::command(response.opcode()))?;
        entries(&mut object, response)?;
        // The wrong length byte of the guide's own example: accepted, never hidden.
        if *length_quirk {
            object.serialize_entry("length_quirk", &true)?;
        }
        object.end()
    }
}

fn entries<M: SerializeMap>(object: &mut M, response: &Response) -> Result<(), M::Error> {
    use Response as R;
    match response {
        R::GetAllAngles { angles, temperature } => {
            object.serialize_entry("angles_mdeg", &angles.map(|angle| angle.0))?;
            write_temperature(object, *temperature)
        }
        R::GetAngle { axis, angle } => {
            object.serialize_entry("axis", &axis.get())?;
            object.serialize_entry("angle_mdeg", &angle.0)
        }
        R::GetAllAngleOffsets { offsets } => {
            object.serialize_entry("offsets_mdeg", &offsets.map(|offset| offset.0))
        }
        R::GetAllData { angles, temperature, accelerations, serial } => {
            object.serialize_entry("angles_mdeg", &angles.map(|angle| angle.0))?;
            write_temperature(object, *temperature)?;
            let raw = accelerations.map(|acceleration| acceleration.0);
            object.serialize_entry("accelerations_raw", &raw)?;
            object.serialize_entry("serial", serial)
        }
        R::GetAllDirections { directions } => {
            object.serialize_entry("directions", &directions.map(names::direction))
        }
        R::GetDamping { damping_ms } => object.serialize_entry("damping_ms", damping_ms),
        R::GetAngleOutputRange(range) => object.serialize_entry("output_range", names::range(*range)),
        R::GetDeviceInformation(information) => write_information(object, information),
        R::SetAngle(status)
        | R::SetAngleOffset(status)
        | R::SetDirection(status)
        | R::SetDamping(status)
        | R::SetAngleOutputRange(status)
        | R::SetBaudRate(status)
        | R::SetAddress(status) => write_status(object, *status),
    }
}

/// A temperature outside −5.00…190.00 °C makes no frame bad, but is marked.
fn write_temperature<M: SerializeMap>(object: &mut M, temperature: Temperature) -> Result<(), M::Error> {
    object.serialize_entry("temperature_centi_c", &temperature.centi_celsius())?;
    if !temperature.is_documented() {
        object.serialize_entry("temperature_out_of_range", &true)?;
    }
    Ok(())
}

fn write_information<M: SerializeMap>(
    object: &mut M,
    information: &DeviceInformation,
) -> Result<(), M::Error> {
    let DeviceInformation { serial, firmware, product, calibration_state } = information;
    object.serialize_entry("serial", serial)?;
    object.serialize_entry("firmware", &shown(firmware))?;
    object.serialize_entry("product", &shown(product))?;
    object.serialize_entry("calibration_state", calibration_state)
}

/// Without trailing blanks; bytes that are not ASCII as `\xNN`.
fn shown(text: &Text) -> String {
    match text.as_str() {
        Some(text) => text.to_owned(),
        None => text.trimmed().escape_ascii().to_string(),
    }
}

fn write_status<M: SerializeMap>(object: &mut M, status: Status) -> Result<(), M::Error> {
    object.serialize_entry("status", names::status(status))?;
    if let Status::Unknown(code) = status {
        object.serialize_entry("status_code", &code.get())?;
    }
    Ok(())
}
