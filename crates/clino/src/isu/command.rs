//! A command to an ISU as one flat JSON object: address, function, and the parameters under the names that `encode`
//! has for them.

use clino_codec::isu::{Command, Request};
use serde::ser::{Serialize, SerializeMap, Serializer};

use super::names;

/// A command to be shown.
pub struct CommandObject(pub Command);

impl Serialize for CommandObject {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Command { address, request } = &self.0;
        let mut object = serializer.serialize_map(None)?;
        object.serialize_entry("address", &address.get())?;
        object.serialize_entry("function", names::function(request.function()))?;
        entries(&mut object, request)?;
        object.end()
    }
}

fn entries<M: SerializeMap>(object: &mut M, request: &Request) -> Result<(), M::Error> {
    match request {
        Request::ReadRam { start, count } | Request::ReadEeprom { start, count } => {
            object.serialize_entry("start", start)?;
            object.serialize_entry("count", count)
        }
        Request::WriteRam { start, data } => {
            object.serialize_entry("start", start)?;
            object.serialize_entry("data", data.as_slice())
        }
        Request::WriteEeprom { start, words } => {
            object.serialize_entry("start", start)?;
            object.serialize_entry("words", &words.iter().collect::<Vec<u16>>())
        }
        Request::GoToSoftErrorState | Request::ResetModule | Request::ResetNullPosition => Ok(()),
    }
}
