//! From the arguments of `clino t7 encode` to a command: each takes exactly the parameters it has.

use clino_codec::t7::{Axis, Opcode, Request};

use super::arguments::Parameters;
use super::names;
use crate::parameter::{need, refuse_others};

impl Parameters {
    /// The command with these parameters.
    ///
    /// # Errors
    /// Which parameter is missing, or not one of this command.
    pub fn request(mut self, opcode: Opcode) -> Result<Request, String> {
        let name = names::command(opcode);
        let request = match opcode {
            Opcode::GetAllAngles => Request::GetAllAngles,
            Opcode::GetAngle0 | Opcode::GetAngle1 | Opcode::GetAngle2 => Request::GetAngle(self.axis(name)?),
            Opcode::SetAngle => Request::SetAngle {
                axis: self.axis(name)?,
                angle: need(name, "--angle-mdeg", &mut self.angle_mdeg)?,
            },
            Opcode::GetAllAngleOffsets => Request::GetAllAngleOffsets,
            Opcode::SetAngleOffset => Request::SetAngleOffset {
                axis: self.axis(name)?,
                offset: need(name, "--offset-mdeg", &mut self.offset_mdeg)?,
            },
            Opcode::GetAllData => Request::GetAllData,
            Opcode::GetAllDirections => Request::GetAllDirections,
            Opcode::SetDirection => Request::SetDirection {
                axis: self.axis(name)?,
                direction: need(name, "--direction", &mut self.direction)?,
            },
            Opcode::GetDamping => Request::GetDamping,
            Opcode::SetDamping => {
                Request::SetDamping { damping_ms: need(name, "--damping-ms", &mut self.damping_ms)? }
            }
            Opcode::GetAngleOutputRange => Request::GetAngleOutputRange,
            Opcode::SetAngleOutputRange => {
                Request::SetAngleOutputRange(need(name, "--range", &mut self.range)?)
            }
            Opcode::GetDeviceInformation => Request::GetDeviceInformation,
            Opcode::SetBaudRate => Request::SetBaudRate(need(name, "--baud", &mut self.baud)?),
            Opcode::SetAddress => Request::SetAddress {
                device_type: need(name, "--device-type", &mut self.device_type)?,
                serial: need(name, "--serial", &mut self.serial)?,
                new_address: need(name, "--new-address", &mut self.new_address)?,
            },
        };
        refuse_others(name, &self.left())?;
        Ok(request)
    }

    fn axis(&mut self, name: &str) -> Result<Axis, String> {
        need(name, "--axis", &mut self.axis)
    }

    /// The parameters not yet used.
    fn left(&self) -> [(&'static str, bool); 10] {
        [
            ("--axis", self.axis.is_some()),
            ("--angle-mdeg", self.angle_mdeg.is_some()),
            ("--offset-mdeg", self.offset_mdeg.is_some()),
            ("--direction", self.direction.is_some()),
            ("--damping-ms", self.damping_ms.is_some()),
            ("--range", self.range.is_some()),
            ("--baud", self.baud.is_some()),
            ("--device-type", self.device_type.is_some()),
            ("--serial", self.serial.is_some()),
            ("--new-address", self.new_address.is_some()),
        ]
    }
}
