//! Streaming decoder for the answer to one command.

use super::answer::size;
use super::error::DecodeError;
use super::frame::{HEADER, OVERHEAD};
use super::opcode::length_fits;
use super::reader::AnswerReader;
use super::{Address, Answer, Expected, Opcode};
use crate::bytes::sum;
use crate::character::{Character, LineErrors};
use crate::checks::Checks;
use crate::stream::{Stream, Verdict};

/// What one more character led to.
pub type DecodeProgress = crate::DecodeProgress<Answer, DecodeError>;

/// Finds the expected answer in a stream of characters.
///
/// `Bad` is a report, not the end: keep feeding characters until the answer comes or its time is over, then
/// call [`idle`](Self::idle). An intact answer of another device, or to another command, is reported as
/// [`DecodeError::Foreign`]. Characters that belong to no frame are counted as [`discarded`](Self::discarded).
///
/// ```
/// use clino_codec::character::Character;
/// use clino_codec::checks::Checks;
/// use clino_codec::t7::{Address, AnswerDecoder, Axis, DecodeProgress, Request};
///
/// let expected = Request::GetAngle(Axis::Two).expected(Address::new(5).unwrap());
/// let mut decoder = AnswerDecoder::new(expected, Checks::ALL);
///
/// let noise_and_answer = [0x00, 0xFF, 0x05, 0x06, 0x83, 0xFF, 0xFF, 0x4E, 0xFF, 0x27];
/// for byte in noise_and_answer {
///     match decoder.push(Character::clean(byte)) {
///         DecodeProgress::More => {}
///         DecodeProgress::Frame(answer) => assert_eq!(answer.address.get(), 5),
///         DecodeProgress::Bad(error) => panic!("{error}"),
///     }
/// }
/// assert_eq!(decoder.discarded(), 2);
/// ```
#[derive(Clone, Debug)]
pub struct AnswerDecoder<R = Checks> {
    answers: Answers<R>,
    stream: Stream<{ super::frame::LONGEST }>,
}

impl<R: AnswerReader> AnswerDecoder<R> {
    /// A decoder that waits for `expected` and applies `checks`.
    ///
    /// With the command check off, a damaged length or command byte can make the decoder wait for a longer
    /// frame; [`idle`](Self::idle) then releases a good frame that was received meanwhile.
    pub const fn new(expected: Expected, checks: R) -> Self {
        Self {
            answers: Answers { expected, size: expected.size() as u16, reader: checks },
            stream: Stream::new(),
        }
    }

    /// Waits for something else from now on. What is held and counted is forgotten.
    pub const fn restart(&mut self, expected: Expected) {
        (self.answers.expected, self.answers.size) = (expected, expected.size() as u16);
        self.forget();
    }

    /// The same, to be read in this way.
    pub const fn restart_with(&mut self, expected: Expected, reader: R) {
        self.answers.reader = reader;
        self.restart(expected);
    }

    /// Forgets what is held and counted.
    pub const fn forget(&mut self) {
        self.stream.restart();
    }

    /// What the decoder waits for.
    pub const fn expected(&self) -> Expected {
        self.answers.expected
    }

    /// Takes one character.
    #[inline]
    pub fn push(&mut self, character: Character) -> DecodeProgress {
        if !self.stream.push(character) {
            return DecodeProgress::More;
        }
        // The usual course of things, apart from the rest because every answer pays for it.
        if let Some(bytes) = self.stream.complete() {
            if let &[address, length, command] = bytes
                && self.answers.is_header([address, length, command])
            {
                self.stream.wait(self.answers.size.into());
                return DecodeProgress::More;
            }
            if let Some(answer) = self.answers.quick(bytes) {
                self.stream.clear();
                self.stream.wait(HEADER);
                return DecodeProgress::Frame(answer);
            }
        }
        self.look(false)
    }

    /// The answer's time is over: settles what is still undecided. Call it until it returns `More`; then
    /// every character is accounted for.
    pub fn idle(&mut self) -> DecodeProgress {
        self.look(true)
    }

    #[inline(never)]
    fn look(&mut self, silent: bool) -> DecodeProgress {
        let Self { answers, stream } = self;
        let mut seen = DecodeProgress::More;
        let counts = stream.look(silent, &[answers.size.into()], &mut |bytes, errors| {
            answers.examine(bytes, errors, &mut seen)
        });
        if counts { seen } else { DecodeProgress::More }
    }

    /// Characters so far that belonged neither to a good nor to a reported frame.
    pub const fn discarded(&self) -> u32 {
        self.stream.discarded()
    }

    /// Characters that may still become a frame.
    pub const fn pending(&self) -> usize {
        self.stream.pending()
    }
}

/// The grammar of answers, for a receiver that waits for one of them.
#[derive(Clone, Debug)]
struct Answers<R> {
    expected: Expected,
    /// Bytes of the expected answer.
    size: u16,
    reader: R,
}

impl<R: AnswerReader> Answers<R> {
    /// Whether the expected answer begins so.
    fn is_header(&self, [address, length, command]: [u8; 3]) -> bool {
        let Expected { address: from, opcode } = self.expected;
        let right = self.size.wrapping_sub(OVERHEAD as u16);
        address == from.get() && u16::from(length) == right && command == opcode.get()
    }

    /// As many bytes as were waited for, behind a header that was examined: the answer, if nothing is wrong with it.
    fn quick(&self, bytes: &[u8]) -> Option<Answer> {
        if bytes.len() == self.size.into() { self.reader.quick(self.expected.opcode, bytes) } else { None }
    }

    /// Reads a frame whose header is that of an expected answer, and that is as long.
    fn read(&self, said: Expected, frame: &[u8]) -> Result<Answer, DecodeError> {
        if said.address.is_all() {
            return Err(DecodeError::UnknownAddress { address: said.address.get() });
        }
        self.reader.read(said, frame)
    }

    /// What starts with these bytes.
    fn examine(&self, bytes: &[u8], errors: &[LineErrors], seen: &mut DecodeProgress) -> Verdict {
        let Some(&[address, length, command]) = bytes.first_chunk() else {
            return Verdict::Incomplete(HEADER);
        };
        let (Some(from), Some(opcode)) = (Address::of_request(address), Opcode::new(command)) else {
            return Verdict::Discard;
        };
        // No device answers as the all-respond address; but a decoder that expects it waits for such a frame and reports it.
        if from.is_all() && !self.is_header([address, length, command]) {
            return Verdict::Discard;
        }
        let checks = self.reader.checks();
        let size = size(opcode);
        let differs = self.expected.differs(from, opcode, checks);
        if !length_fits(length, opcode) {
            if differs.is_some() {
                return Verdict::Discard;
            }
            if checks.length {
                let expected = opcode.response_length();
                *seen = DecodeProgress::Bad(DecodeError::Length { received: length, expected });
                return Verdict::Bad(0);
            }
        }
        let Some(frame) = bytes.get(..size) else {
            return if differs.is_some() { Verdict::IncompleteForeign } else { Verdict::Incomplete(size) };
        };
        let errors = errors.get(..size).unwrap_or(&[]);
        if let Some(differs) = differs {
            let intact = LineErrors::all(errors).is_none() && sum(frame) == 0;
            *seen = DecodeProgress::Bad(DecodeError::Foreign { address: from, opcode, differs });
            return if intact { Verdict::Bad(size) } else { Verdict::Discard };
        }
        match checks.complaint(errors) {
            Some(errors) => seen.settle(Err(DecodeError::LineErrors { errors }), size),
            None => seen.settle(self.read(Expected { address: from, opcode }, frame), size),
        }
    }
}
