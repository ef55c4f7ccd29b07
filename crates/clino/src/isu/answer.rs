//! An answer of an ISU as one flat JSON object.

use clino_codec::isu::{Answer, DeviceError, Response};
use serde::ser::{Serialize, SerializeMap, Serializer};

use super::names;

/// An answer to be shown.
pub struct AnswerObject(pub Answer);

impl Serialize for AnswerObject {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut object = serializer.serialize_map(None)?;
        // Error answers name neither module nor function.
        if let Some(function) = self.0.response.function() {
            object.serialize_entry("address", &self.0.address.get())?;
            object.serialize_entry("function", names::function(function))?;
        }
        entries(&mut object, &self.0)?;
        object.end()
    }
}

fn entries<M: SerializeMap>(object: &mut M, answer: &Answer) -> Result<(), M::Error> {
    match &answer.response {
        Response::ReadRam { start, data } => {
            object.serialize_entry("start", start)?;
            object.serialize_entry("data", data.as_slice())?;
            match answer.angle() {
                Some(angle) => object.serialize_entry("angle_udeg", &angle.udeg()),
                None => Ok(()),
            }
        }
        Response::WriteRam { start, count_or_first_byte } => {
            object.serialize_entry("start", start)?;
            object.serialize_entry("count", count_or_first_byte)?;
            // The document calls it "Data Byte 1" here, and a count in the answer to Write EEPROM.
            object.serialize_entry("count_may_be_first_byte", &true)
        }
        Response::ReadEeprom { start, words } => {
            object.serialize_entry("start", start)?;
            object.serialize_entry("words", &words.iter().collect::<Vec<u16>>())
        }
        Response::WriteEeprom { start, count } => {
            object.serialize_entry("start", start)?;
            object.serialize_entry("count", count)
        }
        Response::Error(error) => {
            object.serialize_entry("device_error", names::device_error(*error))?;
            match error {
                DeviceError::HardwareError { command_byte } => {
                    object.serialize_entry("command_byte", command_byte)
                }
                DeviceError::InvalidFunctionCode | DeviceError::InvalidChecksum => Ok(()),
            }
        }
        Response::GoToSoftErrorState | Response::ResetModule | Response::ResetNullPosition => Ok(()),
    }
}
