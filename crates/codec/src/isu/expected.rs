//! The answer that a command calls for. Source: AN #201 appendix A.

use super::error::{DecodeError, Differs};
use super::frame::OVERHEAD;
use super::{ANGLE_RAM_ADDRESS, ANGLE_RAM_BYTES, Address, Answer, Function, Response};
use crate::checks::Checks;

/// The answer that a command calls for; made by [`Request::expected`](super::Request::expected).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Expected {
    pub(super) address: Address,
    pub(super) function: Function,
    /// The right length byte.
    pub(super) length: u8,
    /// First memory address; zero for functions without.
    pub(super) start: u8,
    /// Bytes or words; zero for functions without.
    pub(super) count: u8,
    /// First byte of a Write RAM command, which its answer may echo instead of the count; else the count.
    pub(super) or_count: u8,
}

impl Expected {
    /// The answer to [`Request::READ_ANGLE`](super::Request::READ_ANGLE) from any module.
    pub const fn angle() -> Self {
        Self {
            address: Address::ANY,
            function: Function::ReadRam,
            length: ANGLE_RAM_BYTES + 2,
            start: ANGLE_RAM_ADDRESS,
            count: ANGLE_RAM_BYTES,
            or_count: ANGLE_RAM_BYTES,
        }
    }

    /// The module that was asked. [`Address::ANY`] expects an answer from any module.
    pub const fn address(&self) -> Address {
        self.address
    }

    /// What was asked.
    pub const fn function(&self) -> Function {
        self.function
    }

    /// How many bytes the answer has, if it is not an error answer.
    pub const fn size(&self) -> usize {
        (self.length as usize).saturating_add(OVERHEAD)
    }

    /// Checks a complete answer against this expectation. The three error answers always fit.
    ///
    /// # Errors
    /// The first check of `checks` that refuses it. A damaged frame is reported as damaged even when its
    /// header is foreign, because the header may be what is damaged.
    pub fn check(&self, bytes: &[u8], checks: Checks) -> Result<Answer, DecodeError> {
        let answer = Answer::decode_with(bytes, checks);
        if let Ok(answer) = &answer {
            self.fits(answer, bytes.len(), checks)?;
        }
        answer
    }

    fn fits(&self, answer: &Answer, size: usize, checks: Checks) -> Result<(), DecodeError> {
        let Some(function) = answer.response.function() else { return Ok(()) };
        let address = answer.address;
        if let Some(differs) = self.differs(address, function, checks) {
            return Err(DecodeError::Foreign { address, function, differs });
        }
        if checks.length && self.function == function && size != self.size() {
            return Err(DecodeError::Size { received: size, expected: self.size() as u16 });
        }
        if checks.command { self.check_memory(&answer.response) } else { Ok(()) }
    }

    #[inline(never)]
    pub(super) fn differs(&self, address: Address, function: Function, checks: Checks) -> Option<Differs> {
        let address = checks.address && !self.address.is_any() && self.address != address;
        let function = checks.command && self.function != function;
        match (address, function) {
            (false, false) => None,
            (true, false) => Some(Differs::Address),
            (false, true) => Some(Differs::Function),
            (true, true) => Some(Differs::Both),
        }
    }

    /// Whether an answer with that length byte can be the expected one.
    pub(super) const fn length_fits(&self, length: u8) -> bool {
        self.length == length
    }

    /// The answer must be about the memory that the command named.
    pub(super) fn check_memory(&self, response: &Response) -> Result<(), DecodeError> {
        let (start, count) = match response {
            Response::ReadRam { start, .. } | Response::ReadEeprom { start, .. } => (*start, self.count),
            Response::WriteEeprom { start, count } => (*start, *count),
            Response::WriteRam { start, count_or_first_byte } => (*start, *count_or_first_byte),
            _ => return Ok(()),
        };
        if start != self.start || (count != self.count && count != self.or_count) {
            let (received, expected) = ((start, count), (self.start, self.count));
            return Err(DecodeError::Memory { received, expected });
        }
        Ok(())
    }
}
