//! ISU messages on the wire, commands and answers alike.
//!
//! ```text
//! byte   0        1                                          2 … length   length + 1
//!        length   address 7…4 │ function 3…1 │ C/R 0         payload      checksum
//! ```
//! `length` counts neither itself nor the checksum. The checksum is the low byte of the plain sum of bytes
//! 1 to `length`. C/R is 0 in a command and 1 in an answer. Words go high byte first.
//!
//! Source: "Interfacing to an ISU Module", section 4 and appendix A.

use crate::node::{Heard, Ns};

/// A message that is not complete after this time is given up ("Command Timeout").
const MESSAGE_LIMIT: Ns = 400_000_000;

/// Low bit of byte 1: the message is an answer.
const ANSWER: u8 = 0x01;

/// "Invalid Function Code" error message.
pub(super) const INVALID_FUNCTION: [u8; 3] = [0x01, 0xFF, 0xFF];

/// "Invalid Checksum" error message.
pub(super) const INVALID_CHECKSUM: [u8; 3] = [0x01, 0xFD, 0xFD];

/// Byte 1 of the "Hardware Error State" message.
const HARD_ERROR: u8 = 0xF1;

/// Function codes (table 2).
pub(super) mod function {
    pub const GO_TO_SOFT_ERROR: u8 = 0;
    pub const RESET: u8 = 1;
    pub const READ_RAM: u8 = 2;
    pub const WRITE_RAM: u8 = 3;
    pub const READ_EEPROM: u8 = 4;
    pub const WRITE_EEPROM: u8 = 5;
    pub const RESET_NULL: u8 = 6;
    /// Not a function: the one code left over.
    pub const INVALID: u8 = 7;
}

/// Whether the module follows the answers of others that reach its receiver.
///
/// The document speaks of commands only. On a line where modules hear each other, a module that scans for
/// commands alone takes pieces of answers for commands and can be deaf to real ones until its 400 ms timeout.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OthersAnswers {
    /// Recognised by their own (length, function) pairs and skipped whole.
    #[default]
    Followed,
    /// Searched for commands like any other bytes.
    Scanned,
}

/// A complete message with a valid (length, function) pair.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Message {
    /// Byte 1 as received.
    pub head: u8,
    pub payload: Vec<u8>,
    pub sum_is_right: bool,
}

impl Message {
    pub fn address(&self) -> u8 {
        self.head >> 4
    }

    pub fn function(&self) -> u8 {
        function_of(self.head)
    }

    pub fn is_command(&self) -> bool {
        self.head & ANSWER == 0
    }
}

fn function_of(head: u8) -> u8 {
    head >> 1 & 7
}

fn sum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte))
}

/// A whole answer to a command, from the address nibble given. `None` if it is too long for its length byte.
pub(super) fn answer(address: u8, function: u8, payload: &[u8]) -> Option<Vec<u8>> {
    let length = u8::try_from(payload.len() + 1).ok()?;
    let mut bytes = vec![length, address << 4 | function << 1 | ANSWER];
    bytes.extend_from_slice(payload);
    bytes.push(sum(&bytes[1..]));
    Some(bytes)
}

/// The answer of a module in the Hard Error state to a command whose byte 1 was `head`.
pub(super) fn hard_error(head: u8) -> Vec<u8> {
    vec![0x02, HARD_ERROR, head, sum(&[HARD_ERROR, head])]
}

/// Whether a command of this function can have this length byte (appendix A).
fn is_command_pair(length: u8, function: u8) -> bool {
    match function {
        function::GO_TO_SOFT_ERROR | function::RESET | function::RESET_NULL => length == 1,
        function::READ_RAM | function::READ_EEPROM => length == 3,
        // At least one byte or one word.
        function::WRITE_RAM => length >= 3,
        function::WRITE_EEPROM => length >= 4 && length.is_multiple_of(2),
        // No length belongs to it, yet it has an error message of its own: any will do.
        _ => length >= 1,
    }
}

/// Whether an answer with this byte 1 can have this length byte (appendix A and the error messages).
fn is_answer_pair(length: u8, head: u8) -> bool {
    match (head, function_of(head)) {
        (HARD_ERROR, _) => length == 2,
        (_, function::INVALID) => [length, head] == INVALID_FUNCTION[..2],
        (_, function::READ_RAM) => length >= 3,
        (_, function::READ_EEPROM) => length >= 4 && length.is_multiple_of(2),
        (_, function::WRITE_RAM | function::WRITE_EEPROM) => length == 3,
        _ => length == 1,
    }
}

/// Searches the characters for messages.
#[derive(Clone, Debug, Default)]
pub(super) struct Receiver {
    /// Characters not yet understood, and when each was heard.
    pending: Vec<(Ns, u8)>,
}

impl Receiver {
    /// Takes one character. A bad stop bit makes nonsense of the message under way.
    pub fn push(&mut self, heard: Heard) {
        let too_old = |&(at, _): &(Ns, u8)| heard.at.saturating_sub(at) > MESSAGE_LIMIT;
        if heard.framing_error || self.pending.first().is_some_and(too_old) {
            self.pending.clear();
        }
        if !heard.framing_error {
            self.pending.push((heard.at, heard.byte));
        }
    }

    /// The next complete message. Characters that begin no valid (length, function) pair are dropped one
    /// by one.
    pub fn next_message(&mut self, others: OthersAnswers) -> Option<Message> {
        loop {
            let [(_, length), (_, head), ..] = *self.pending else {
                return None;
            };
            let is_valid = if head & ANSWER == 0 {
                is_command_pair(length, function_of(head))
            } else {
                others == OthersAnswers::Followed && is_answer_pair(length, head)
            };
            if !is_valid {
                self.pending.remove(0);
                continue;
            }
            let total = usize::from(length) + 2;
            if self.pending.len() < total {
                return None;
            }
            let bytes: Vec<u8> = self.pending.drain(..total).map(|(_, byte)| byte).collect();
            let (covered, checksum) = (&bytes[1..total - 1], bytes[total - 1]);
            return Some(Message {
                head,
                payload: covered[1..].to_vec(),
                sum_is_right: sum(covered) == checksum,
            });
        }
    }

    /// Forgets everything.
    pub fn reset(&mut self) {
        self.pending.clear();
    }
}
