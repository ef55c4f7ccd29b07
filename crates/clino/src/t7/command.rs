//! A command to a T7 as one flat JSON object: address, command, and the parameters under the names that `encode`
//! has for them.

use clino_codec::t7::{Command, Request};
use serde::ser::{Serialize, SerializeMap, Serializer};

use super::names;

/// A command to be shown.
pub struct CommandObject(pub Command);

impl Serialize for CommandObject {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Command { address, request } = &self.0;
        let mut object = serializer.serialize_map(None)?;
        object.serialize_entry("address", &address.get())?;
        object.serialize_entry("command", names::command(request.opcode()))?;
        entries(&mut object, request)?;
        object.end()
    }
}

fn entries<M: SerializeMap>(object: &mut M, request: &Request) -> Result<(), M::Error> {
    use Request as R;
    match request {
        R::GetAngle(axis) => object.serialize_entry("axis", &axis.get()),
        R::SetAngle { axis, angle } => {
            object.serialize_entry("axis", &axis.get())?;
            object.serialize_entry("angle_mdeg", &angle.0)
        }
        R::SetAngleOffset { axis, offset } => {
            object.serialize_entry("axis", &axis.get())?;
            object.serialize_entry("offset_mdeg", &offset.0)
        }
        R::SetDirection { axis, direction } => {
            object.serialize_entry("axis", &axis.get())?;
            object.serialize_entry("direction", names::direction(*direction))
        }
        R::SetDamping { damping_ms } => object.serialize_entry("damping_ms", damping_ms),
        R::SetAngleOutputRange(range) => object.serialize_entry("output_range", names::range(*range)),
        R::SetBaudRate(rate) => object.serialize_entry("baud", &rate.bits_per_second()),
        R::SetAddress { device_type, serial, new_address } => {
            object.serialize_entry("device_type", names::device_type(*device_type))?;
            object.serialize_entry("serial", serial)?;
            object.serialize_entry("new_address", &new_address.get())
        }
        R::GetAllAngles
        | R::GetAllAngleOffsets
        | R::GetAllData
        | R::GetAllDirections
        | R::GetDamping
        | R::GetAngleOutputRange
        | R::GetDeviceInformation => Ok(()),
    }
}
