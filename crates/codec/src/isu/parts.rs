//! The frame that all messages share. Source: AN #201 table 1.

use super::error::DecodeError;
use super::frame::{LONGEST, OVERHEAD};
use super::function::RESPONSE;
use super::{Address, Function};
use crate::bytes::sum;

/// Shortest message: length, head, checksum.
const SHORTEST: usize = 3;
/// Head of the three error answers. Source: §4.
pub(super) const INVALID_FUNCTION_CODE: u8 = 0xFF;
pub(super) const INVALID_CHECKSUM: u8 = 0xFD;
pub(super) const HARDWARE_ERROR: u8 = 0xF1;

/// Whether an error answer begins so.
pub(super) const fn is_device_error(length: u8, head: u8) -> bool {
    // All but the last have no payload; that has one byte.
    matches!((length, head), (1, INVALID_FUNCTION_CODE | INVALID_CHECKSUM) | (2, HARDWARE_ERROR))
}

/// A message with nothing wrong around its payload.
#[derive(Clone, Copy, Debug)]
pub(super) struct Parts<'a> {
    pub(super) address: Address,
    /// `None` in the error answers.
    pub(super) function: Option<Function>,
    /// Address, function and direction.
    pub(super) head: u8,
    payload: &'a [u8],
}

impl<'a> Parts<'a> {
    /// Takes a command, or an answer, apart; `direction` is zero or [`RESPONSE`].
    #[inline(never)]
    pub(super) fn open(bytes: &'a [u8], direction: u8, checksum: bool) -> Result<Self, DecodeError> {
        let &[length, head, ref payload @ .., _] = bytes else {
            return Err(DecodeError::Size { received: bytes.len(), expected: SHORTEST as u16 });
        };
        let expected = usize::from(length).wrapping_add(OVERHEAD);
        if bytes.len() != expected {
            return Err(DecodeError::Size { received: bytes.len(), expected: expected as u16 });
        }
        // A whole message that no value here has room for.
        if expected > LONGEST {
            return Err(DecodeError::Size { received: bytes.len(), expected: LONGEST as u16 });
        }
        if head & RESPONSE != direction {
            return Err(DecodeError::Direction { head });
        }
        let address = Address::of_head(head);
        let mut parts = Self { address, function: None, head, payload };
        // None of the error answers' heads is a command's.
        if !is_device_error(length, head) {
            let function = Function::of_head(head).ok_or(DecodeError::UnknownFunction { head })?;
            if address.is_reserved() {
                return Err(DecodeError::ReservedAddress { head });
            }
            let carries_data = function.carries_data(direction != 0);
            if !function.length_fits(length, carries_data) {
                return Err(DecodeError::Length { length, function });
            }
            parts.function = Some(function);
        }
        if checksum {
            check_sum(bytes)?;
        }
        Ok(parts)
    }

    /// The same of a message about which all that is known already but its checksum.
    pub(super) fn of(address: Address, function: Option<Function>, bytes: &'a [u8]) -> Self {
        let (head, payload) = match bytes {
            &[_, head, ref payload @ .., _] => (head, payload),
            _ => (0, &[][..]),
        };
        Self { address, function, head, payload }
    }

    /// Memory address and what follows it; zero and nothing in messages without.
    pub(super) fn memory(&self) -> (u8, &'a [u8]) {
        match self.payload {
            [start, rest @ ..] => (*start, rest),
            [] => (0, &[]),
        }
    }
}

/// Checks a whole message's last byte. The checksum covers everything but the length byte, and is not negated.
pub(super) fn check_sum(bytes: &[u8]) -> Result<(), DecodeError> {
    let [_, covered @ .., received] = bytes else { return Ok(()) };
    let (received, computed) = (*received, sum(covered));
    if computed == received { Ok(()) } else { Err(DecodeError::Checksum { received, computed }) }
}
