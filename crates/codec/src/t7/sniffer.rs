//! Listening to both directions of a T7 bus.

use super::answer::{length_fits, size};
use super::error::DecodeError;
use super::frame::{LONGEST, OVERHEAD};
use super::{Address, Answer, Command, Opcode, Request};
use crate::bytes::Reader;
use crate::character::{Character, LineErrors};
use crate::layers::Layers;
use crate::stream::{Front, Grammar, Stream};

/// A message overheard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Sniffed {
    /// From the host.
    Command(Command),
    /// From a device.
    Answer {
        /// What it said.
        answer: Answer,
        /// The command that it answers, if that was heard.
        to: Option<Command>,
    },
}

/// What one more character led to.
pub type SniffProgress = crate::Progress<Sniffed, DecodeError>;

/// Takes apart what host and devices say on one line.
///
/// Commands and answers look alike: Set Angle Output Range and Set Baud Rate even have the same length in
/// both directions. The order tells them apart: what fits the last command is its answer. Tell the sniffer
/// with [`idle`](Self::idle) when the line has been silent for longer than a device may take (2 ms after a
/// Get, 25 ms after a Set command), or a repeated command is taken for an answer.
///
/// Get commands have no checksum, so that a few bytes of noise can look like one.
///
/// ```
/// use clino_codec::character::Character;
/// use clino_codec::layers::Layers;
/// use clino_codec::t7::{SniffProgress, Sniffed, Sniffer, Status};
///
/// let mut sniffer = Sniffer::new(Layers::ALL);
/// let mut statuses = 0;
/// for byte in [0x05, 0x03, 0x8D, 0x01, 0x6A, 0x05, 0x03, 0x8D, 0x00, 0x6B] {
///     if let SniffProgress::Frame(Sniffed::Answer { answer, to: Some(_) }) = sniffer.push(Character::clean(byte)) {
///         assert_eq!(answer.response.status(), Some(Status::Success));
///         statuses += 1;
///     }
/// }
/// assert_eq!(statuses, 1);
/// ```
#[derive(Clone, Debug)]
pub struct Sniffer {
    grammar: Conversation,
    stream: Stream<LONGEST>,
}

impl Sniffer {
    /// A sniffer that has heard nothing. The address, command and length layers play no part: nothing is
    /// expected.
    pub const fn new(layers: Layers) -> Self {
        Self { grammar: Conversation { layers, asked: None }, stream: Stream::new() }
    }

    /// Takes one character.
    pub fn push(&mut self, character: Character) -> SniffProgress {
        self.stream.push(&mut self.grammar, character)
    }

    /// The line has been silent for longer than an answer may take: settles what is still undecided, and
    /// expects a command next. Call it until it returns `More`.
    pub fn idle(&mut self) -> SniffProgress {
        let progress = self.stream.idle(&mut self.grammar);
        if progress == SniffProgress::More {
            self.grammar.asked = None;
        }
        progress
    }

    /// Characters so far that belonged neither to a good nor to a reported frame.
    pub const fn junk(&self) -> u32 {
        self.stream.junk()
    }
}

/// The grammar of both directions.
#[derive(Clone, Debug)]
struct Conversation {
    layers: Layers,
    /// The last command, while its answer is outstanding.
    asked: Option<Command>,
}

impl Conversation {
    /// Whether a message from `address` with that code answers the last command.
    fn is_asked(&self, address: u8, code: u8) -> bool {
        self.asked.is_some_and(|asked| {
            let to_us = asked.address.is_all() || asked.address.get() == address;
            to_us && asked.request.opcode().get() == code
        })
    }
}

impl Grammar for Conversation {
    type Frame = Sniffed;
    type Error = DecodeError;

    const HEADER: usize = 3;

    fn front(&self, bytes: &[u8]) -> Front<DecodeError> {
        let [address, length, code] = Reader::new(bytes).array();
        let (Some(to), Some(opcode)) = (Address::of_request(address), Opcode::new(code)) else {
            return Front::Junk;
        };
        if length == opcode.request_length() {
            Front::Wanted(usize::from(length).saturating_add(OVERHEAD))
        } else if length_fits(length, opcode) && !to.is_all() {
            Front::Wanted(size(opcode))
        } else {
            Front::Junk
        }
    }

    fn dirty(&self, errors: LineErrors) -> Option<DecodeError> {
        let matters = self.layers.line_errors && !errors.is_none();
        matters.then_some(DecodeError::LineErrors { errors })
    }

    fn judge(&mut self, bytes: &[u8]) -> Result<Sniffed, DecodeError> {
        let [address, length, code] = Reader::new(bytes).array();
        let is_asked = self.is_asked(address, code);
        let commands_length = Opcode::new(code).is_some_and(|opcode| length == opcode.request_length());
        let answers_length = Opcode::new(code).is_some_and(|opcode| length_fits(length, opcode));
        if answers_length && (is_asked || !commands_length) {
            let answer = Answer::decode_with(bytes, self.layers)?;
            let to = self.asked.filter(|_| is_asked);
            // Everybody answers a command to all: more may come.
            self.asked = self.asked.filter(|asked| asked.address.is_all());
            return Ok(Sniffed::Answer { answer, to });
        }
        let command = Request::decode(bytes)?;
        self.asked = Some(command);
        Ok(Sniffed::Command(command))
    }

    fn foreign(&self, _: &[u8], _: LineErrors) -> Option<DecodeError> {
        None
    }

    fn wanted_lengths(&self) -> [usize; 3] {
        [0; 3]
    }
}
