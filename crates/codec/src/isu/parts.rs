//! The frame that all messages share. Source: AN #201 table 1.

use super::error::DecodeError;
use super::frame::OVERHEAD;
use super::{Address, Function};
use crate::bytes::sum;

/// Shortest message: length, head, checksum.
const SHORTEST: usize = 3;

/// A message of the announced size, taken apart but not yet checked.
#[derive(Clone, Copy, Debug)]
pub(super) struct Parts<'a> {
    pub(super) length: u8,
    /// Address, function and direction.
    pub(super) head: u8,
    pub(super) payload: &'a [u8],
    checksum: u8,
}

impl<'a> Parts<'a> {
    pub(super) fn split(bytes: &'a [u8]) -> Result<Self, DecodeError> {
        let [length, head, payload @ .., checksum] = bytes else {
            return Err(DecodeError::Size { received: bytes.len(), expected: SHORTEST });
        };
        let expected = usize::from(*length).saturating_add(OVERHEAD);
        if bytes.len() != expected {
            return Err(DecodeError::Size { received: bytes.len(), expected });
        }
        Ok(Self { length: *length, head: *head, payload, checksum: *checksum })
    }

    pub(super) fn address_and_function(&self) -> Result<(Address, Function), DecodeError> {
        let head = self.head;
        let function = Function::of_head(head).ok_or(DecodeError::UnknownFunction { head })?;
        let address = Address::of_head(head);
        if address.is_reserved() {
            return Err(DecodeError::ReservedAddress { head });
        }
        Ok((address, function))
    }

    /// The checksum covers everything but the length byte, and is not negated.
    pub(super) fn check_sum(&self) -> Result<(), DecodeError> {
        let computed = sum(self.payload).wrapping_add(self.head);
        if computed != self.checksum {
            return Err(DecodeError::Checksum { received: self.checksum, computed });
        }
        Ok(())
    }

    /// Memory address and what follows it; zero and nothing in messages without.
    pub(super) fn memory(&self) -> (u8, &'a [u8]) {
        match self.payload {
            [start, rest @ ..] => (*start, rest),
            [] => (0, &[]),
        }
    }
}
