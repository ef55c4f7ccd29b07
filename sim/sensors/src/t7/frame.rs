//! T7 messages on the wire, commands and answers alike.
//!
//! ```text
//! byte   0        1        2         3 … length   length + 1
//!        address  length   command   data         checksum (Set commands and all answers)
//! ```
//! Big endian. `length` counts the bytes after itself. The checksum is the two's complement of the low
//! byte of the sum of everything before it, so a whole message sums to zero.
//!
//! Source: "T7 Communication User Guide" 1.7, sections 1, 1.1, 1.2.

use crate::node::{Heard, Ns};

/// A command must be shorter than this from its first byte to its last (section 1).
const COMMAND_LIMIT: Ns = 500_000_000;

/// Address and length byte.
const HEADER: usize = 2;

/// The byte that makes `bytes` sum to zero.
pub(super) fn checksum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte)).wrapping_neg()
}

/// A whole answer with a length byte that need not be the true one.
pub(super) fn answer_with_length(address: u8, length: u8, command: u8, data: &[u8]) -> Vec<u8> {
    let mut bytes = vec![address, length, command];
    bytes.extend_from_slice(data);
    bytes.push(checksum(&bytes));
    bytes
}

/// A whole answer.
pub(super) fn answer(address: u8, command: u8, data: &[u8]) -> Vec<u8> {
    // The longest answer, Get All Data, has 30 data bytes.
    answer_with_length(address, data.len() as u8 + 2, command, data)
}

/// A message as it went over the line, for whomever it is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Message {
    pub address: u8,
    /// The command byte and all after it, `length` bytes; empty if the length byte is 0.
    pub body: Vec<u8>,
    /// All bytes sum to zero, as those of Set commands must.
    pub sums_to_zero: bool,
}

/// Collects characters into messages.
///
/// Other nodes' answers have the same header as commands, so they are skipped as whole messages. Whatever
/// breaks that rhythm (a lost or invented byte, a false length) leaves the receiver out of step until a
/// framing error, or until 500 ms after the false first byte.
#[derive(Clone, Debug, Default)]
pub(super) struct Receiver {
    bytes: Vec<u8>,
    first_at: Ns,
}

impl Receiver {
    /// Takes one character; returns the message that it completes.
    pub fn take(&mut self, heard: Heard) -> Option<Message> {
        if heard.framing_error {
            self.bytes.clear();
            return None;
        }
        if heard.at.saturating_sub(self.first_at) >= COMMAND_LIMIT {
            self.bytes.clear();
        }
        if self.bytes.is_empty() {
            self.first_at = heard.at;
        }
        self.bytes.push(heard.byte);
        let (&[address, length], body) = self.bytes.split_first_chunk::<HEADER>()?;
        if body.len() < usize::from(length) {
            return None;
        }
        let message = Message { address, body: body.to_vec(), sums_to_zero: checksum(&self.bytes) == 0 };
        self.bytes.clear();
        Some(message)
    }

    /// Forgets a message that has begun.
    pub fn reset(&mut self) {
        self.bytes.clear();
    }
}
