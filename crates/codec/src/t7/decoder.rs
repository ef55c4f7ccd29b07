//! Streaming decoder for the answer to one command.

use super::answer::{length_fits, size};
use super::error::DecodeError;
use super::{Address, Answer, Expected, Opcode};
use crate::bytes::{Reader, sum};
use crate::character::{Character, LineErrors};
use crate::layers::Layers;
use crate::stream::{Front, Grammar, Stream};

/// What one more character led to.
pub type Progress = crate::Progress<Answer, DecodeError>;

/// Finds the expected answer in a stream of characters.
///
/// `Bad` is a report, not the end: keep feeding characters until the answer comes or its time is over, then
/// call [`idle`](Self::idle). An intact answer of another device, or to another command, is reported as
/// [`DecodeError::Foreign`]. Characters that belong to no frame are counted as [`junk`](Self::junk).
///
/// ```
/// use clino_codec::character::Character;
/// use clino_codec::layers::Layers;
/// use clino_codec::t7::{Address, AnswerDecoder, Axis, Progress, Request};
///
/// let expected = Request::GetAngle(Axis::Two).expected(Address::new(5).unwrap());
/// let mut decoder = AnswerDecoder::new(expected, Layers::ALL);
///
/// let noise_and_answer = [0x00, 0xFF, 0x05, 0x06, 0x83, 0xFF, 0xFF, 0x4E, 0xFF, 0x27];
/// for byte in noise_and_answer {
///     match decoder.push(Character::clean(byte)) {
///         Progress::More => {}
///         Progress::Frame(answer) => assert_eq!(answer.address.get(), 5),
///         Progress::Bad(error) => panic!("{error}"),
///     }
/// }
/// assert_eq!(decoder.junk(), 2);
/// ```
#[derive(Clone, Debug)]
pub struct AnswerDecoder {
    grammar: Answers,
    stream: Stream<{ super::frame::LONGEST }>,
}

impl AnswerDecoder {
    /// A decoder that waits for `expected` and applies `layers`.
    ///
    /// With the command check off, a damaged length or command byte can make the decoder wait for a longer
    /// frame; [`idle`](Self::idle) then releases a good frame that was received meanwhile.
    pub const fn new(expected: Expected, layers: Layers) -> Self {
        let Expected { address, opcode } = expected;
        let header = [address.get(), opcode.response_length(), opcode.get()];
        Self { grammar: Answers { expected, layers, header, size: size(opcode) }, stream: Stream::new() }
    }

    /// What the decoder waits for.
    pub const fn expected(&self) -> Expected {
        self.grammar.expected
    }

    /// Takes one character.
    #[inline]
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
    /// How the expected answer begins, for a quick look, and how long it is.
    header: [u8; 3],
    size: usize,
}

impl Grammar for Answers {
    type Frame = Answer;
    type Error = DecodeError;

    const HEADER: usize = 3;

    fn front(&self, bytes: &[u8]) -> Front<DecodeError> {
        let [address, length, command] = Reader::new(bytes).array();
        if [address, length, command] == self.header {
            return Front::Wanted(self.size);
        }
        let (Some(address), Some(opcode)) = (Address::new(address), Opcode::new(command)) else {
            return Front::Junk;
        };
        let fits = length_fits(length, opcode);
        match self.expected.differs(address, opcode, self.layers) {
            None if fits || !self.layers.length => Front::Wanted(size(opcode)),
            None => {
                Front::Refused(DecodeError::Length { received: length, expected: opcode.response_length() })
            }
            Some(_) if fits => Front::Foreign(size(opcode)),
            Some(_) => Front::Junk,
        }
    }

    fn dirty(&self, errors: LineErrors) -> Option<DecodeError> {
        let matters = self.layers.line_errors && !errors.is_none();
        matters.then_some(DecodeError::LineErrors { errors })
    }

    fn judge(&mut self, bytes: &[u8]) -> Result<Answer, DecodeError> {
        Answer::decode_with(bytes, self.layers)
    }

    fn foreign(&self, bytes: &[u8], errors: LineErrors) -> Option<DecodeError> {
        let [address, _, command] = Reader::new(bytes).array();
        let (address, opcode) = (Address::new(address)?, Opcode::new(command)?);
        let differs = self.expected.differs(address, opcode, self.layers)?;
        let intact = errors.is_none() && sum(bytes) == 0;
        intact.then_some(DecodeError::Foreign { address, opcode, differs })
    }

    fn wanted_lengths(&self) -> [usize; 3] {
        [self.size, 0, 0]
    }
}
