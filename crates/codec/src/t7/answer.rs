//! An answer with its sender, and the checks it has to pass. Source: T7 guide §1.2.

use super::envelope::{Envelope, Speaker};
use super::error::{DecodeError, Differs};
use super::frame::{AnswerFrame, OVERHEAD};
use super::opcode::{PRINTED_GET_ALL_ANGLES_LENGTH, is_quirk};
use super::{Address, Axis, Millidegrees, Opcode, Response, fields};
use crate::bytes::sum;
use crate::checks::{Checks, ValueRange};

/// Length byte of Get Angle. Source: §2.1.2.
const GET_ANGLE_LENGTH: u8 = Opcode::GetAngle0.response_length();

/// An answer.
///
/// ```
/// use clino_codec::t7::{Address, Answer, Axis, Millidegrees, Response};
///
/// let answer = Answer::decode(&[0x05, 0x06, 0x83, 0xFF, 0xFF, 0x4E, 0xFF, 0x27]).unwrap();
/// assert_eq!(answer.address.get(), 5);
/// assert_eq!(answer.response, Response::GetAngle { axis: Axis::Two, angle: Millidegrees(-45_313) });
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Answer {
    /// The device that answered, never [`Address::ALL`].
    pub address: Address,
    /// The response.
    pub response: Response,
    /// The length byte of a Get All Angles answer was 0A, as in the guide's example, instead of the right 10.
    /// Worth counting, not worth refusing: checksum and number of bytes are demanded all the same.
    pub length_quirk: bool,
}

/// The answer that a command calls for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Expected {
    /// The device that was asked. [`Address::ALL`] expects an answer from any device.
    pub address: Address,
    /// What was asked.
    pub opcode: Opcode,
}

impl Expected {
    /// How many bytes the answer has.
    pub const fn size(&self) -> usize {
        size(self.opcode)
    }

    /// In what an answer from `address` to `opcode` differs from this one.
    #[inline(never)]
    pub(super) fn differs(&self, address: Address, opcode: Opcode, checks: Checks) -> Option<Differs> {
        let address = checks.address && !self.address.is_all() && self.address != address;
        let opcode = checks.command && self.opcode != opcode;
        match (address, opcode) {
            (false, false) => None,
            (true, false) => Some(Differs::Address),
            (false, true) => Some(Differs::Command),
            (true, true) => Some(Differs::Both),
        }
    }

    /// Checks a complete answer against this expectation.
    ///
    /// # Errors
    /// The first check of `checks` that refuses it. A damaged frame is reported as damaged even when its
    /// header is foreign, because the header may be what is damaged.
    pub fn check(&self, bytes: &[u8], checks: Checks) -> Result<Answer, DecodeError> {
        let answer = Answer::decode_with(bytes, checks);
        if let Ok(Answer { address, response, .. }) = answer {
            let opcode = response.opcode();
            if let Some(differs) = self.differs(address, opcode, checks) {
                return Err(DecodeError::Foreign { address, opcode, differs });
            }
        }
        answer
    }
}

impl Answer {
    /// Decodes bytes that are exactly one answer, from any device and to any request.
    ///
    /// # Errors
    /// Whatever is wrong with them.
    pub fn decode(bytes: &[u8]) -> Result<Self, DecodeError> {
        Self::decode_with(bytes, Checks::ALL)
    }

    /// As [`decode`](Self::decode), with some checks off. Checks that need an expectation play no part.
    ///
    /// # Errors
    /// The first check of `checks` that refuses the bytes.
    pub fn decode_with(bytes: &[u8], checks: Checks) -> Result<Self, DecodeError> {
        if let Some(answer) = Self::angle(bytes, checks.values) {
            return Ok(answer);
        }
        let Envelope { address, opcode, .. } = Envelope::open(bytes, Speaker::Device, checks)?;
        Self::read(Expected { address, opcode }, bytes, checks)
    }

    /// The answer that is polled all day, if it is one that no check refuses: a short cut.
    #[inline]
    pub(super) fn angle(bytes: &[u8], values: ValueRange) -> Option<Self> {
        let &[address, GET_ANGLE_LENGTH, code, a, b, c, d, _] = bytes else { return None };
        let axis = Axis::new(code.wrapping_sub(Opcode::GetAngle0.get()))?;
        let address = Address::new(address)?;
        let angle = Millidegrees(i32::from_be_bytes([a, b, c, d]));
        let is_good = sum(bytes) == 0 && values.allows(angle);
        is_good.then_some(Self { address, response: Response::GetAngle { axis, angle }, length_quirk: false })
    }

    /// Reads a frame that is as long as answers to this command are.
    #[inline(never)]
    pub(super) fn read(
        Expected { address, opcode }: Expected,
        frame: &[u8],
        checks: Checks,
    ) -> Result<Self, DecodeError> {
        let &[_, length, _, ref body @ ..] = frame else {
            return Err(DecodeError::Size { received: frame.len(), expected: size(opcode) });
        };
        if !opcode.is_set() {
            fields::check(opcode, body, checks.values)?;
        }
        let response = Response::read(opcode, body);
        Ok(Self { address, response, length_quirk: is_quirk(length, opcode) })
    }

    /// The answer as the device sends it, length quirk included.
    pub fn encode(&self) -> AnswerFrame {
        let mut frame = self.response.encode(self.address);
        if self.length_quirk && self.response.opcode() == Opcode::GetAllAngles {
            frame.set_length_byte(PRINTED_GET_ALL_ANGLES_LENGTH);
        }
        frame
    }
}

/// Bytes of a whole answer to a command.
pub(super) const fn size(opcode: Opcode) -> usize {
    (opcode.response_length() as usize).saturating_add(OVERHEAD)
}
