//! Streaming decoder for the answer to one command.

use super::error::DecodeError;
use super::frame::{LONGEST, OVERHEAD};
use super::function::RESPONSE;
use super::response::device_error_size;
use super::{Address, Answer, Expected, Function};
use crate::bytes::Reader;
use crate::character::{Character, LineErrors};
use crate::layers::Layers;
use crate::stream::{Front, Grammar, Stream};

/// What one more character led to.
pub type Progress = crate::Progress<Answer, DecodeError>;

/// Finds the expected answer, or one of the three error answers, in a stream of characters.
///
/// `Bad` is a report, not the end: keep feeding characters until the answer comes or its time is over, then
/// call [`idle`](Self::idle). An intact answer of another module, or to another function, is reported as
/// [`DecodeError::Foreign`]. Characters that belong to no frame are counted as [`junk`](Self::junk).
///
/// ```
/// use clino_codec::character::Character;
/// use clino_codec::isu::{Address, AnswerDecoder, Progress, Request};
/// use clino_codec::layers::Layers;
///
/// let expected = Request::READ_ANGLE.expected(Address::ANY);
/// let mut decoder = AnswerDecoder::new(expected, Layers::ALL);
///
/// let mut angle = None;
/// for byte in [0x00, 0x04, 0x05, 0x58, 0x80, 0x00, 0xDD] {
///     if let Progress::Frame(answer) = decoder.push(Character::clean(byte)) {
///         angle = answer.angle();
///     }
/// }
/// assert_eq!(angle.unwrap().to_string(), "180.000");
/// assert_eq!(decoder.junk(), 1);
/// ```
#[derive(Clone, Debug)]
pub struct AnswerDecoder {
    grammar: Answers,
    stream: Stream<LONGEST>,
}

impl AnswerDecoder {
    /// A decoder that waits for `expected` and applies `layers`.
    pub const fn new(expected: Expected, layers: Layers) -> Self {
        Self { grammar: Answers { expected, layers }, stream: Stream::new() }
    }

    /// What the decoder waits for.
    pub const fn expected(&self) -> Expected {
        self.grammar.expected
    }

    /// Takes one character.
    pub fn push(&mut self, character: Character) -> Progress {
        self.stream.push(&mut self.grammar, character)
    }

    /// The answer's time is over: settles what is still undecided. Call it until it returns `More`; then
    /// every character is accounted for.
    pub fn idle(&mut self) -> Progress {
        self.stream.idle(&mut self.grammar)
    }

    /// Characters so far that belonged neither to a good nor to a reported frame.
    pub const fn junk(&self) -> u32 {
        self.stream.junk()
    }

    /// Characters that may still become a frame.
    pub const fn pending(&self) -> usize {
        self.stream.pending()
    }
}

/// The grammar of answers, seen by someone who waits for one of them.
#[derive(Clone, Debug)]
struct Answers {
    expected: Expected,
    layers: Layers,
}

impl Answers {
    /// Sender and function of an answer that could stand on this line.
    fn meant(head: u8) -> Option<(Address, Function)> {
        let (address, function) = (Address::of_head(head), Function::of_head(head)?);
        let possible = head & RESPONSE != 0 && !address.is_reserved();
        possible.then_some((address, function))
    }
}

impl Grammar for Answers {
    type Frame = Answer;
    type Error = DecodeError;

    const HEADER: usize = 2;

    fn front(&self, bytes: &[u8]) -> Front<DecodeError> {
        let [length, head] = Reader::new(bytes).array();
        if let Some(size) = device_error_size(length, head) {
            return Front::Wanted(size);
        }
        let Some((address, function)) = Self::meant(head) else { return Front::Junk };
        let possible = function.response_length_fits(length);
        let size = usize::from(length).saturating_add(OVERHEAD);
        match self.expected.differs(address, function, self.layers) {
            None if self.expected.length_fits(length) => Front::Wanted(size),
            None if possible && !self.layers.length => Front::Wanted(size),
            None if possible && function != self.expected.function() => Front::Wanted(size),
            None => Front::Refused(DecodeError::Length { length, function }),
            Some(_) if possible => Front::Foreign(size),
            Some(_) => Front::Junk,
        }
    }

    fn dirty(&self, errors: LineErrors) -> Option<DecodeError> {
        let matters = self.layers.line_errors && !errors.is_none();
        matters.then_some(DecodeError::LineErrors { errors })
    }

    fn judge(&mut self, bytes: &[u8]) -> Result<Answer, DecodeError> {
        self.expected.check(bytes, self.layers)
    }

    fn foreign(&self, bytes: &[u8], errors: LineErrors) -> Option<DecodeError> {
        let [_, head] = Reader::new(bytes).array();
        let (address, function) = Self::meant(head)?;
        let differs = self.expected.differs(address, function, self.layers)?;
        let intact = errors.is_none() && Answer::decode(bytes).is_ok();
        intact.then_some(DecodeError::Foreign { address, function, differs })
    }

    fn wanted_lengths(&self) -> [usize; 3] {
        [self.expected.size(), 3, 4]
    }
}
