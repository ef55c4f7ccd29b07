//! What each ISU function does.
//!
//! Source: "Interfacing to an ISU Module", section 4 and appendix A. What the document leaves open, and
//! what is done here:
//!
//! | Open | Here |
//! |---|---|
//! | address in an answer to a command for address 0 | an option, the command's by default |
//! | command for address 15 | ignored, whatever the EEPROM says |
//! | Write RAM: byte 3 of the answer, first data byte or count | an option, the data byte by default |
//! | reading more than an answer's length byte can tell | no answer |
//! | addresses past FFH | go on at 00H |
//! | Reset Null Position: is it kept? | stored with a new checksum, in effect with the next angle |
//! | Reset Null Position in the Soft Error state, where there is no angle | answered, nothing changed |

use std::collections::VecDeque;

use super::angle;
use super::eeprom::location;
use super::frame::{self, Message, function};
use super::{AnswerAddress, Isu, Mode, WriteRamEcho};
use crate::said::Said;

/// RAM address of the current angle, high byte first (table 3).
pub(super) const CURRENT_ANGLE: u8 = 0x58;

/// All modules respond to this address.
const EVERYONE: u8 = 0;

/// No module responds to this address.
const RESERVED: u8 = 15;

/// What happens when the command is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum After {
    Nothing,
    /// The settings in the EEPROM may have changed.
    Adopt,
    /// The null position has changed to this.
    Null(u16),
    /// Power-on reset, once the answer is out.
    Reset,
}

/// A command understood: words to store one by one, then an answer.
#[derive(Debug)]
pub(super) struct Plan {
    pub writes: VecDeque<(u8, u16)>,
    pub answer: Vec<u8>,
    pub told: Option<Said>,
    pub after: After,
}

impl Plan {
    fn answer(answer: Vec<u8>) -> Self {
        Self { writes: VecDeque::new(), answer, told: None, after: After::Nothing }
    }
}

impl Isu {
    /// What to do about a message, if anything.
    pub(super) fn plan(&mut self, message: &Message) -> Option<Plan> {
        let to = message.address();
        let for_us = to == EVERYONE || (to == self.active.address && to != RESERVED);
        if !for_us || !message.is_command() {
            return None;
        }
        if !message.sum_is_right {
            return Some(Plan::answer(frame::INVALID_CHECKSUM.to_vec()));
        }
        if message.function() == function::INVALID {
            return Some(Plan::answer(frame::INVALID_FUNCTION.to_vec()));
        }
        if self.mode == Mode::HardError && message.function() != function::GO_TO_SOFT_ERROR {
            return Some(Plan::answer(frame::hard_error(message.head)));
        }
        self.plan_function(message)
    }

    fn plan_function(&mut self, message: &Message) -> Option<Plan> {
        let function = message.function();
        let from = match self.options.answer_address {
            AnswerAddress::AsAsked => message.address(),
            AnswerAddress::Own => self.active.address,
        };
        let simple = |payload: &[u8]| Some(Plan::answer(frame::answer(from, function, payload)?));
        match (function, message.payload.as_slice()) {
            (function::GO_TO_SOFT_ERROR, []) => {
                if self.mode == Mode::HardError {
                    self.mode = Mode::SoftError;
                }
                simple(&[])
            }
            (function::RESET, []) => Some(Plan { after: After::Reset, ..simple(&[])? }),
            (function::READ_RAM, &[start, count]) => {
                let mut payload = vec![start];
                payload.extend((0..count).map(|i| self.ram[usize::from(start.wrapping_add(i))]));
                let is_angle = (start, count) == (CURRENT_ANGLE, 2) && self.mode == Mode::Normal;
                let told = is_angle.then(|| self.reading(angle::to_microdegrees(self.code())));
                Some(Plan { told, ..simple(&payload)? })
            }
            (function::WRITE_RAM, &[start, first, ref rest @ ..]) => {
                let data = core::iter::once(first).chain(rest.iter().copied());
                for (i, byte) in (0..=u8::MAX).zip(data) {
                    self.ram[usize::from(start.wrapping_add(i))] = byte;
                }
                simple(&[
                    start,
                    match self.options.write_ram_echo {
                        WriteRamEcho::FirstDataByte => first,
                        WriteRamEcho::Count => rest.len() as u8 + 1,
                    },
                ])
            }
            (function::READ_EEPROM, &[start, count]) => {
                let mut payload = vec![start];
                let words = (0..count).map(|i| self.eeprom.word(start.wrapping_add(i)));
                payload.extend(words.flat_map(u16::to_be_bytes));
                simple(&payload)
            }
            (function::WRITE_EEPROM, &[start, ref data @ ..]) => {
                let words = data.as_chunks::<2>().0.iter().map(|word| u16::from_be_bytes(*word));
                let writes: VecDeque<_> = (0..=u8::MAX).map(|i| start.wrapping_add(i)).zip(words).collect();
                let payload = [start, writes.len() as u8];
                Some(Plan { writes, after: After::Adopt, ..simple(&payload)? })
            }
            (function::RESET_NULL, []) if self.mode == Mode::Normal => {
                let null = self.measured;
                let (writes, after) = (self.null_writes(null).into(), After::Null(null));
                Some(Plan { writes, after, ..simple(&[])? })
            }
            (function::RESET_NULL, []) => simple(&[]),
            _ => None,
        }
    }

    /// The words that store a null position, and after them those that store the checksum.
    fn null_writes(&self, null: u16) -> Vec<(u8, u16)> {
        let mut next = self.eeprom.clone();
        let mut writes = next.encoded(location::NULL_POSITION, null);
        for &(address, word) in &writes {
            next.set_word(address, word);
        }
        writes.extend(next.encoded(location::CHECKSUM, next.computed_checksum()));
        writes
    }
}
