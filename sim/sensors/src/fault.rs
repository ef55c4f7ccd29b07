//! Faults in the answers of a sensor that is powered and on the line: it damages, delays, shortens or withholds answers.
//!
//! The faults act on a finished answer just before it is sent, so a command that changes a setting has changed it
//! even when its answer never comes. Noise on the line is not a fault of the sensor and not made here.

use crate::node::Ns;

/// What goes wrong with one answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AnswerFault {
    /// The checksum, the last byte, comes inverted.
    BadChecksum,
    /// This status instead of the true one, under a right checksum. Only a T7's answers to Set commands have
    /// a status; other answers pass unharmed.
    WrongStatus(u8),
    /// No answer.
    Silent,
    /// The answer comes this many nanoseconds later than it would.
    Late(Ns),
    /// Only this many bytes of the answer come.
    Truncated(usize),
    /// These bytes instead of the answer.
    Instead(Vec<u8>),
}

/// The faults that a node shows. The default is none.
#[derive(Clone, Debug, Default)]
pub struct AnswerFaults {
    /// Hears nothing at all while set.
    pub deaf: bool,
    /// Strikes the next answer, once.
    pub next: Option<AnswerFault>,
    /// Strikes every answer whose number is a multiple of the first field.
    pub every: Option<(u64, AnswerFault)>,
    /// Answers so far, struck ones included.
    pub answers: u64,
}

/// An answer after the faults have been at it.
#[derive(Debug)]
pub(crate) struct Struck {
    pub bytes: Vec<u8>,
    pub delay: Ns,
    /// The bytes are the ones the sensor meant to send.
    pub unharmed: bool,
}

impl AnswerFaults {
    /// Counts one answer and does to it what is due. `with_status` gives the answer another status, if it has
    /// one. An empty result is not sent.
    pub(crate) fn strike(
        &mut self,
        mut bytes: Vec<u8>,
        with_status: impl Fn(&[u8], u8) -> Option<Vec<u8>>,
    ) -> Struck {
        self.answers += 1;
        let due = self.next.take().or_else(|| match &self.every {
            Some((n, fault)) if self.answers.checked_rem(*n) == Some(0) => Some(fault.clone()),
            _ => None,
        });
        let intact = bytes.clone();
        let mut delay = 0;
        match due {
            None => {}
            Some(AnswerFault::BadChecksum) => {
                if let Some(checksum) = bytes.last_mut() {
                    *checksum = !*checksum;
                }
            }
            Some(AnswerFault::WrongStatus(status)) => {
                bytes = with_status(&bytes, status).unwrap_or(bytes);
            }
            Some(AnswerFault::Silent) => bytes.clear(),
            Some(AnswerFault::Late(by)) => delay = by,
            Some(AnswerFault::Truncated(length)) => bytes.truncate(length),
            Some(AnswerFault::Instead(other)) => bytes = other,
        }
        Struck { unharmed: bytes == intact, bytes, delay }
    }
}
