//! How a decoder reads the answer that it has found: any answer, or only what was asked.
//!
//! A program that asks for angles alone need not contain what reads all other answers, 0.8 KB: [`Request::reader`] chooses where
//! the compiler knows the request.

use super::envelope::check_sum;
use super::error::{DecodeError, Field};
use super::{Address, Answer, Expected, Millidegrees, Opcode, Request, Response};
use crate::checks::{CheckSet, Checks, ValueRange};

/// How a decoder reads an answer, and which checks it has to pass: [`Checks`] for any answer, [`AsAsked`] for one that was asked
/// for.
pub trait AnswerReader: CheckSet {
    /// The answer, if no check refuses it. `frame` is as long as this command's answer and begins as it does.
    fn quick(self, asked: Opcode, frame: &[u8]) -> Option<Answer>;

    /// Reads what `said` names: a frame that is as long as that, of which nothing behind the header was checked.
    ///
    /// # Errors
    /// The first check that refuses it, the checksum's before that of the values.
    fn read(self, said: Expected, frame: &[u8]) -> Result<Answer, DecodeError>;
}

impl AnswerReader for Checks {
    /// The answer that is polled all day.
    #[inline]
    fn quick(self, _: Opcode, frame: &[u8]) -> Option<Answer> {
        Answer::angle(frame, self.values)
    }

    #[inline]
    fn read(self, said: Expected, frame: &[u8]) -> Result<Answer, DecodeError> {
        if self.checksum {
            check_sum(frame)?;
        }
        Answer::read(said, frame, self)
    }
}

/// The answer to one request, all checks on: see [`Request::reader`].
#[derive(Clone, Copy, Debug)]
pub struct AsAsked(fn(Expected, &[u8]) -> Result<Answer, DecodeError>);

impl CheckSet for AsAsked {
    #[inline(always)]
    fn checks(self) -> Checks {
        Checks::ALL
    }
}

impl AnswerReader for AsAsked {
    #[inline]
    fn quick(self, opcode: Opcode, frame: &[u8]) -> Option<Answer> {
        let address = Address::new(*frame.first()?)?;
        self.read(Expected { address, opcode }, frame).ok()
    }

    #[inline]
    fn read(self, said: Expected, frame: &[u8]) -> Result<Answer, DecodeError> {
        self.0(said, frame)
    }
}

impl Request {
    /// How the answer to this is read. Worked out where it is called: of a request that the compiler knows, only what reads its
    /// answer is in the program.
    #[inline(always)]
    pub const fn reader(&self) -> AsAsked {
        AsAsked(if let Self::GetAngle(_) = self { angle } else { any })
    }
}

/// Any answer.
fn any(said: Expected, frame: &[u8]) -> Result<Answer, DecodeError> {
    check_sum(frame)?;
    Answer::read(said, frame, Checks::ALL)
}

/// The answer that is polled all day.
fn angle(Expected { address, opcode }: Expected, frame: &[u8]) -> Result<Answer, DecodeError> {
    let (&[.., a, b, c, d, _], Some(axis)) = (frame, opcode.axis()) else {
        return Err(DecodeError::UnknownCommand { command: opcode.get() });
    };
    check_sum(frame)?;
    let angle = Millidegrees(i32::from_be_bytes([a, b, c, d]));
    if !ValueRange::AnyMode.allows(angle) {
        return Err(DecodeError::Value { field: Field::Angle, value: angle.0 });
    }
    Ok(Answer { address, response: Response::GetAngle { axis, angle }, length_quirk: false })
}
