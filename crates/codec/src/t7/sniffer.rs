//! Listening to both directions of a T7 bus.

use super::answer::size;
use super::error::DecodeError;
use super::frame::{HEADER, LONGEST, OVERHEAD};
use super::opcode::length_fits;
use super::{Address, Answer, Command, Opcode, Request};
use crate::character::{Character, LineErrors};
use crate::checks::Checks;
use crate::stream::{Stream, Verdict};

/// A message overheard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Sniffed {
    /// From the host.
    Command(Command),
    /// From a device.
    Answer {
        /// The answer.
        answer: Answer,
        /// The command that it answers, if that was heard.
        to: Option<Command>,
    },
}

/// What one more character led to.
pub type SniffProgress = crate::DecodeProgress<Sniffed, DecodeError>;

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
/// use clino_codec::checks::Checks;
/// use clino_codec::t7::{SniffProgress, Sniffed, Sniffer, Status};
///
/// let mut sniffer = Sniffer::new(Checks::ALL);
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
    conversation: Conversation,
    stream: Stream<LONGEST>,
}

impl Sniffer {
    /// A sniffer that has heard nothing. The address, command and length checks play no part: nothing is
    /// expected.
    pub const fn new(checks: Checks) -> Self {
        Self { conversation: Conversation { checks, asked: None }, stream: Stream::new() }
    }

    /// Takes one character.
    pub fn push(&mut self, character: Character) -> SniffProgress {
        if self.stream.push(character) { self.look(false) } else { SniffProgress::More }
    }

    /// The line has been silent for longer than an answer may take: settles what is still undecided, and
    /// expects a command next. Call it until it returns `More`.
    pub fn idle(&mut self) -> SniffProgress {
        let progress = self.look(true);
        if let SniffProgress::More = progress {
            self.conversation.asked = None;
        }
        progress
    }

    #[inline(never)]
    fn look(&mut self, silent: bool) -> SniffProgress {
        let Self { conversation, stream } = self;
        let mut seen = SniffProgress::More;
        let counts =
            stream.look(silent, &[], &mut |bytes, errors| conversation.examine(bytes, errors, &mut seen));
        if counts { seen } else { SniffProgress::More }
    }

    /// Characters so far that belonged neither to a good nor to a reported frame.
    pub const fn discarded(&self) -> u32 {
        self.stream.discarded()
    }
}

/// The grammar of both directions.
#[derive(Clone, Debug)]
struct Conversation {
    checks: Checks,
    /// The last command, while its answer is outstanding.
    asked: Option<Command>,
}

impl Conversation {
    /// What starts with these bytes.
    fn examine(&mut self, bytes: &[u8], errors: &[LineErrors], seen: &mut SniffProgress) -> Verdict {
        let Some(&[address, length, code]) = bytes.first_chunk() else {
            return Verdict::Incomplete(HEADER);
        };
        let (Some(to), Some(opcode)) = (Address::of_request(address), Opcode::new(code)) else {
            return Verdict::Discard;
        };
        let commands_length = length == opcode.request_length();
        let answers_length = length_fits(length, opcode);
        let size = if commands_length {
            usize::from(length).saturating_add(OVERHEAD)
        } else if answers_length && !to.is_all() {
            size(opcode)
        } else {
            return Verdict::Discard;
        };
        let Some(frame) = bytes.get(..size) else { return Verdict::Incomplete(size) };
        let errors = errors.get(..size).unwrap_or(&[]);
        if let Some(errors) = self.checks.complaint(errors) {
            return seen.settle(Err(DecodeError::LineErrors { errors }), size);
        }
        let to = self.asked.filter(|asked| asked.calls_for(address, opcode));
        if answers_length && (to.is_some() || !commands_length) {
            let answer = match Answer::decode_with(frame, self.checks) {
                Ok(answer) => answer,
                Err(error) => return seen.settle(Err(error), size),
            };
            // All devices answer a command to all: more may come.
            self.asked = self.asked.filter(|asked| asked.address.is_all());
            seen.settle(Ok(Sniffed::Answer { answer, to }), size)
        } else {
            let command = match Request::decode(frame) {
                Ok(command) => command,
                Err(error) => return seen.settle(Err(error), size),
            };
            self.asked = Some(command);
            seen.settle(Ok(Sniffed::Command(command)), size)
        }
    }
}

impl Command {
    /// Whether a message from that address with that code answers it.
    fn calls_for(&self, address: u8, opcode: Opcode) -> bool {
        (self.address.is_all() || self.address.get() == address) && self.request.opcode() == opcode
    }
}
