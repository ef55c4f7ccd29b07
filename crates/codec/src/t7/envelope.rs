//! What all messages have in common: address, length, command, checksum. Source: T7 guide §1.1, §1.2.

use super::error::DecodeError;
use super::frame::{HEADER, OVERHEAD};
use super::opcode::length_fits;
use super::{Address, Opcode};
use crate::bytes::sum;
use crate::checks::Checks;

/// The sender: host or device.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Speaker {
    Host,
    Device,
}

/// A message with nothing wrong around its body.
pub(super) struct Envelope<'a> {
    pub(super) address: Address,
    pub(super) opcode: Opcode,
    /// Parameters, data or status, then the checksum if there is one.
    pub(super) body: &'a [u8],
}

impl<'a> Envelope<'a> {
    #[inline(never)]
    pub(super) fn open(bytes: &'a [u8], from: Speaker, checks: Checks) -> Result<Self, DecodeError> {
        let host = from == Speaker::Host;
        // A device says at least one byte, and adds a checksum.
        let shortest = if host { HEADER } else { HEADER + 2 };
        let (Some(&[address, length, command]), true) = (bytes.first_chunk(), bytes.len() + 1 >= shortest)
        else {
            return Err(DecodeError::Size { received: bytes.len(), expected: shortest });
        };
        let Some(opcode) = Opcode::new(command) else { return Err(DecodeError::UnknownCommand { command }) };
        let known = if host { Address::of_request(address) } else { Address::new(address) };
        let Some(address) = known else { return Err(DecodeError::UnknownAddress { address }) };
        let right = if host { opcode.request_length() } else { opcode.response_length() };
        if checks.length && length != right && (host || !length_fits(length, opcode)) {
            return Err(DecodeError::Length { received: length, expected: right });
        }
        let expected = usize::from(right).wrapping_add(OVERHEAD);
        if bytes.len() != expected {
            return Err(DecodeError::Size { received: bytes.len(), expected });
        }
        if checks.checksum && (!host || opcode.is_set()) {
            check_sum(bytes)?;
        }
        Ok(Self { address, opcode, body: body(bytes) })
    }
}

/// What follows the header.
pub(super) fn body(bytes: &[u8]) -> &[u8] {
    bytes.get(HEADER..).unwrap_or(&[])
}

/// A message with a checksum sums to zero.
pub(super) fn check_sum(bytes: &[u8]) -> Result<(), DecodeError> {
    let total = sum(bytes);
    if total == 0 {
        return Ok(());
    }
    // Taking the total from the last byte leaves the byte that would have made the total zero.
    let received = bytes.last().copied().unwrap_or(0);
    Err(DecodeError::Checksum { received, computed: received.wrapping_sub(total) })
}
