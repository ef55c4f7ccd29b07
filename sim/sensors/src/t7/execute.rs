//! What each of the T7's commands does.
//!
//! Source: "T7 Communication User Guide" 1.7, sections 1.3, 1.4 and 2.
//!
//! What the document leaves open, and what is done here:
//!
//! | Open | Here |
//! |---|---|
//! | unknown command code | status 01 |
//! | Get command of a wrong length | status 01 |
//! | Set command of a wrong length, right checksum | status 03 |
//! | axis 0 or 1 of a single-axis T7 in a Set command | status 03 |
//! | angle or offset outside the present output range | status 03 |
//! | Set Address that names another type or serial number | no answer: the device meant gives one |
//! | too long an answer asked from address 126 | no answer |
//! | an answer that carries its own address, a twin's | an option, dropped by default |

use super::command::Command;
use super::settings::{
    AXES, BAUD_RATES, DAMPING_MS, Direction, Flash, OutputRange, SETTABLE_ADDRESSES, StoredSettings,
};
use super::{T7, angle, frame};
use crate::node::Ns;
use crate::said::Said;

/// All T7s respond at this address (section 1.4) …
pub(super) const ALL_RESPOND: u8 = 126;

/// … but only with answers whose length byte is at most this.
const ALL_RESPOND_LONGEST: u8 = 8;

/// The length byte printed in the example of section 2.1.1; its table says 0x10.
const PRINTED_ALL_ANGLES_LENGTH: u8 = 0x0A;

/// Status values (section 1.3).
mod status {
    pub const SUCCESS: u8 = 0;
    pub const INVALID_COMMAND: u8 = 1;
    pub const INVALID_PARAMETER: u8 = 3;
    pub const CHECKSUM_ERROR: u8 = 4;
    pub const ADDRESS_OUT_OF_RANGE: u8 = 9;
}

/// What a command led to.
#[derive(Debug, Default)]
pub(super) struct Outcome {
    /// The whole answer; empty for none.
    pub bytes: Vec<u8>,
    /// The angles in it.
    pub angles: Vec<Said>,
    /// Baud rate index to switch to after the answer.
    pub new_baud: Option<u8>,
}

impl T7 {
    /// Carries out a message that this device is meant to hear.
    pub(super) fn execute(&mut self, now: Ns, message: &frame::Message) -> Outcome {
        let own = self.settings.address;
        let Some((&code, parameters)) = message.body.split_first() else {
            return Outcome::default();
        };
        let Some(command) = Command::from_code(code) else {
            return answer(own, code, &[status::INVALID_COMMAND]);
        };
        if message.address == ALL_RESPOND && command.answer_length() > ALL_RESPOND_LONGEST {
            return Outcome::default();
        }
        if command.is_set() {
            self.execute_set(now, command, message)
        } else if parameters.is_empty() {
            self.execute_get(now, command)
        } else {
            answer(own, code, &[status::INVALID_COMMAND])
        }
    }

    fn execute_get(&self, now: Ns, command: Command) -> Outcome {
        let (own, code) = (self.settings.address, command as u8);
        match command {
            Command::GetAngle0 => self.angles(now, 0..1, code, &[]),
            Command::GetAngle1 => self.angles(now, 1..2, code, &[]),
            Command::GetAngle2 => self.angles(now, 2..3, code, &[]),
            Command::GetAllAngles => {
                let mut outcome = self.angles(now, 0..AXES, code, &self.options.temperature.to_be_bytes());
                if self.options.length_quirk {
                    // Header and checksum are made anew around the same data.
                    let data = outcome.bytes[3..outcome.bytes.len() - 1].to_vec();
                    outcome.bytes = frame::answer_with_length(own, PRINTED_ALL_ANGLES_LENGTH, code, &data);
                }
                outcome
            }
            Command::GetAllData => {
                let mut rest = self.options.temperature.to_be_bytes().to_vec();
                let true_angles = [0, 1, 2].map(|axis: usize| self.options.motion[axis].at(now));
                for acceleration in angle::accelerations(self.identity.model, true_angles) {
                    rest.extend(acceleration.to_be_bytes());
                }
                rest.extend(self.identity.serial.to_be_bytes());
                self.angles(now, 0..AXES, code, &rest)
            }
            Command::GetAllOffsets => {
                let range = self.settings.range;
                let data = self.settings.offsets.map(|offset| angle::in_range(offset, range).to_be_bytes());
                answer(own, code, data.as_flattened())
            }
            Command::GetAllDirections => answer(own, code, &self.settings.directions.map(|d| d as u8)),
            Command::GetDamping => answer(own, code, &self.settings.damping_ms.to_be_bytes()),
            Command::GetRange => answer(own, code, &[self.settings.range as u8]),
            Command::GetInformation => {
                let mut data = self.identity.serial.to_be_bytes().to_vec();
                data.extend(self.identity.firmware);
                data.extend(self.identity.product);
                data.extend(self.identity.calibration.to_be_bytes());
                answer(own, code, &data)
            }
            Command::SetAngle
            | Command::SetOffset
            | Command::SetDirection
            | Command::SetDamping
            | Command::SetRange
            | Command::SetBaudRate
            | Command::SetAddress => Outcome::default(),
        }
    }

    /// An answer that begins with the angles of some axes.
    fn angles(&self, now: Ns, axes: core::ops::Range<usize>, code: u8, rest: &[u8]) -> Outcome {
        let mut data = Vec::new();
        let mut angles = Vec::new();
        for axis in axes {
            let millidegrees = self.angle_at(axis, now);
            data.extend(millidegrees.to_be_bytes());
            angles.push(Said {
                at: now,
                sampled_at: now,
                axis: axis as u8,
                microdegrees: i64::from(millidegrees) * 1000,
            });
        }
        data.extend_from_slice(rest);
        Outcome { angles, ..answer(self.settings.address, code, &data) }
    }

    fn execute_set(&mut self, now: Ns, command: Command, message: &frame::Message) -> Outcome {
        // The answer to Set Address still carries the old one (section 2.8).
        let own = self.settings.address;
        let code = command as u8;
        if !message.sums_to_zero {
            return answer(own, code, &[status::CHECKSUM_ERROR]);
        }
        if message.body.len() != command.length() {
            return answer(own, code, &[status::INVALID_PARAMETER]);
        }
        // Command byte and checksum are at the ends.
        let parameters = &message.body[1..message.body.len() - 1];
        if let (Command::SetAddress, [_, s0, s1, s2, s3, _]) = (command, parameters) {
            let named = (parameters[0], u32::from_be_bytes([*s0, *s1, *s2, *s3]));
            if named != (self.identity.model as u8, self.identity.serial) {
                return Outcome::default();
            }
        }
        let status = match (self.changed(now, command, parameters), self.flash) {
            (Err(status), _) => status,
            (Ok(settings), Flash::Sound) => {
                self.settings = settings;
                self.writes += 1;
                status::SUCCESS
            }
            (Ok(_), failure) => failure as u8,
        };
        let new_baud = (command == Command::SetBaudRate && status == status::SUCCESS)
            .then_some(self.settings.baud_index);
        Outcome { new_baud, ..answer(own, code, &[status]) }
    }

    /// The settings with one of them changed, or the status that says why not.
    fn changed(&self, now: Ns, command: Command, parameters: &[u8]) -> Result<StoredSettings, u8> {
        let invalid = status::INVALID_PARAMETER;
        let mut settings = self.settings.clone();
        match (command, parameters) {
            (Command::SetAngle, &[axis, a, b, c, d]) => {
                let (axis, wanted) = self.axis_and_angle(axis, [a, b, c, d]).ok_or(invalid)?;
                let measured = angle::directed(self.absolute_at(axis, now), self.settings.directions[axis]);
                settings.offsets[axis] = angle::in_range(wanted - measured, settings.range);
            }
            (Command::SetOffset, &[axis, a, b, c, d]) => {
                let (axis, offset) = self.axis_and_angle(axis, [a, b, c, d]).ok_or(invalid)?;
                settings.offsets[axis] = offset;
            }
            (Command::SetDirection, &[axis, direction]) => {
                let axis = self.axis(axis).ok_or(invalid)?;
                settings.directions[axis] = match direction {
                    0 => Direction::Normal,
                    1 => Direction::Reversed,
                    _ => return Err(invalid),
                };
            }
            (Command::SetDamping, &[high, low]) => {
                let damping = u16::from_be_bytes([high, low]);
                if !DAMPING_MS.contains(&damping) {
                    return Err(invalid);
                }
                settings.damping_ms = damping;
            }
            (Command::SetRange, &[range]) => {
                settings.range = match range {
                    0 => OutputRange::Bidirectional,
                    1 => OutputRange::Unidirectional,
                    _ => return Err(invalid),
                };
            }
            (Command::SetBaudRate, &[index]) => {
                BAUD_RATES.get(usize::from(index)).ok_or(invalid)?;
                settings.baud_index = index;
            }
            (Command::SetAddress, &[.., address]) => {
                if !SETTABLE_ADDRESSES.contains(&address) {
                    return Err(status::ADDRESS_OUT_OF_RANGE);
                }
                settings.address = address;
            }
            _ => return Err(invalid),
        }
        Ok(settings)
    }

    fn axis(&self, axis: u8) -> Option<usize> {
        let axis = usize::from(axis);
        angle::has_axis(self.identity.model, axis).then_some(axis)
    }

    fn axis_and_angle(&self, axis: u8, angle: [u8; 4]) -> Option<(usize, i32)> {
        let angle = i32::from_be_bytes(angle);
        angle::fits(angle, self.settings.range).then_some((self.axis(axis)?, angle))
    }
}

fn answer(address: u8, code: u8, data: &[u8]) -> Outcome {
    Outcome { bytes: frame::answer(address, code, data), ..Outcome::default() }
}
