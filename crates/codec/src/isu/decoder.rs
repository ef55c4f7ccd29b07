//! Streaming decoder for the answer to one command.

use super::error::DecodeError;
use super::frame::{LONGEST, OVERHEAD};
use super::function::RESPONSE;
use super::parts::{Parts, check_sum, is_device_error};
use super::{Address, Answer, Expected, Function, Response};
use crate::character::{Character, LineErrors};
use crate::checks::{CheckSet, Checks};
use crate::stream::{Stream, Verdict};

/// How many bytes it takes to tell what starts with them.
const HEADER: usize = 2;
/// Bytes of the error answers.
const ERROR_SIZE: usize = 3;
const HARDWARE_ERROR_SIZE: usize = 4;

/// What one more character led to.
pub type DecodeProgress = crate::DecodeProgress<Answer, DecodeError>;

/// Finds the expected answer, or one of the three error answers, in a stream of characters.
///
/// `Bad` is a report, not the end: keep feeding characters until the answer comes or its time is over, then
/// call [`idle`](Self::idle). An intact answer of another module, or to another function, is reported as
/// [`DecodeError::Foreign`]. Characters that belong to no frame are counted as [`discarded`](Self::discarded).
///
/// ```
/// use clino_codec::character::Character;
/// use clino_codec::isu::{Address, AnswerDecoder, DecodeProgress, Request};
/// use clino_codec::checks::Checks;
///
/// let expected = Request::READ_ANGLE.expected(Address::ANY);
/// let mut decoder = AnswerDecoder::new(expected, Checks::ALL);
///
/// let mut angle = None;
/// for byte in [0x00, 0x04, 0x05, 0x58, 0x80, 0x00, 0xDD] {
///     if let DecodeProgress::Frame(answer) = decoder.push(Character::clean(byte)) {
///         angle = answer.angle();
///     }
/// }
/// assert_eq!(angle.unwrap().to_string(), "180.000");
/// assert_eq!(decoder.discarded(), 1);
/// ```
#[derive(Clone, Debug)]
pub struct AnswerDecoder<C = Checks> {
    answers: Answers<C>,
    stream: Stream<LONGEST>,
}

impl<C: CheckSet> AnswerDecoder<C> {
    /// A decoder that waits for `expected` and applies `checks`.
    pub const fn new(expected: Expected, checks: C) -> Self {
        Self { answers: Answers { expected, checks }, stream: Stream::new() }
    }

    /// Waits for something else from now on. What is held and counted is forgotten.
    pub const fn restart(&mut self, expected: Expected) {
        self.answers.expected = expected;
        self.forget();
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
    pub fn push(&mut self, character: Character) -> DecodeProgress {
        if self.stream.push(character) { self.look(false) } else { DecodeProgress::More }
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
        let wanted = [answers.expected.size(), ERROR_SIZE, HARDWARE_ERROR_SIZE];
        let counts =
            stream.look(silent, &wanted, &mut |bytes, errors| answers.examine(bytes, errors, &mut seen));
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
struct Answers<C> {
    expected: Expected,
    checks: C,
}

impl<C: CheckSet> Answers<C> {
    /// Reads a frame whose header is that of an expected answer, and that is as long.
    fn read(&self, parts: Parts<'_>, frame: &[u8]) -> Result<Answer, DecodeError> {
        let checks = self.checks.checks();
        if checks.checksum {
            check_sum(frame)?;
        }
        let response = Response::read(&parts);
        if checks.command {
            self.expected.check_memory(&response)?;
        }
        Ok(Answer { address: parts.address, response })
    }

    /// What starts with these bytes.
    fn examine(&self, bytes: &[u8], errors: &[LineErrors], seen: &mut DecodeProgress) -> Verdict {
        let Some(&[length, head]) = bytes.first_chunk() else { return Verdict::Incomplete(HEADER) };
        let checks = self.checks.checks();
        let size = usize::from(length).saturating_add(OVERHEAD);
        let (from, mut answers, mut foreign) = (Address::of_head(head), None, None);
        if !is_device_error(length, head) {
            // Sender and function of an answer that could stand on this line.
            let Some(function) = Function::of_head(head) else { return Verdict::Discard };
            answers = Some(function);
            let possible = function.response_length_fits(length);
            // One that is too long to be held is never the expected one.
            if head & RESPONSE == 0 || from.is_reserved() || size > LONGEST {
                return Verdict::Discard;
            }
            if let Some(differs) = self.expected.differs(from, function, checks) {
                if !possible {
                    return Verdict::Discard;
                }
                foreign = Some(DecodeError::Foreign { address: from, function, differs });
            } else if !self.expected.length_fits(length)
                && !(possible && (!checks.length || function != self.expected.function()))
            {
                *seen = DecodeProgress::Bad(DecodeError::Length { length, function });
                return Verdict::Bad(0);
            }
        }
        let Some(frame) = bytes.get(..size) else {
            return if foreign.is_some() { Verdict::IncompleteForeign } else { Verdict::Incomplete(size) };
        };
        let errors = errors.get(..size).unwrap_or(&[]);
        if let Some(error) = foreign {
            let intact = LineErrors::all(errors).is_none() && check_sum(frame).is_ok();
            *seen = DecodeProgress::Bad(error);
            return if intact { Verdict::Bad(size) } else { Verdict::Discard };
        }
        match checks.complaint(errors) {
            Some(errors) => seen.settle(Err(DecodeError::LineErrors { errors }), size),
            None => seen.settle(self.read(Parts::of(from, answers, frame), frame), size),
        }
    }
}
