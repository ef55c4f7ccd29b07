//! Writing to memory that the document does not name.
//!
//! "Modification of other data will most likely render the module inoperable and irreparable" (AN #201 section 6).
//!
//! Two locks against accidents: an ordinary master refuses such writes, so that it takes one that
//! speaks [`UnprotectedIsu`]; and the operation's constructor says what it risks.

mod protocol;

pub use protocol::UnprotectedIsu;

use clino_bus::line::MAX_FRAME;
use clino_bus::{ExchangeOutcome, Instant};
use clino_codec::isu::{Address, EncodeError, Function, Request, Response};

use super::talk::response;
use super::{Cause, Failure, Module};
use crate::{Operation, READ_TRIES, Step, StepOf, TaskProgress};

/// Why there is no raw write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum RawRefusal {
    /// Not a write.
    NotAWrite(Function),
    /// Impossible even so.
    Encode(EncodeError),
    /// More than a line takes at once.
    TooLong {
        /// Characters of the command.
        characters: usize,
        /// Most that a line takes.
        max: usize,
    },
}

/// Writes any memory, once, and reads it back.
#[derive(Clone, Copy, Debug)]
pub struct RawWrite {
    address: Address,
    request: Request,
    state: State,
    cancelled: bool,
}

#[derive(Clone, Copy, Debug)]
enum State {
    Write,
    Read,
    Ended(Result<(), Failure>),
}

impl RawWrite {
    /// Writes RAM or EEPROM of that module, wherever the request says. The EEPROM's checksum is the caller's business.
    ///
    /// # Errors
    /// [`RawRefusal`].
    pub fn new_even_if_it_bricks_the_module(
        module: Module,
        request: Request,
    ) -> Result<RawWrite, RawRefusal> {
        if !matches!(request, Request::WriteRam { .. } | Request::WriteEeprom { .. }) {
            return Err(RawRefusal::NotAWrite(request.function()));
        }
        let frame =
            request.encode_even_if_it_bricks_the_module(module.address()).map_err(RawRefusal::Encode)?;
        let characters = frame.as_bytes().len();
        if characters > MAX_FRAME {
            return Err(RawRefusal::TooLong { characters, max: MAX_FRAME });
        }
        Ok(RawWrite { address: module.address(), request, state: State::Write, cancelled: false })
    }

    /// Reads what the request writes.
    fn read_back(&self) -> Request {
        match &self.request {
            Request::WriteEeprom { start, words } => {
                Request::ReadEeprom { start: *start, count: words.len() as u8 }
            }
            Request::WriteRam { start, data } => {
                Request::ReadRam { start: *start, count: data.as_slice().len() as u8 }
            }
            other => *other,
        }
    }

    fn writes(&self) -> u8 {
        u8::from(!matches!(self.state, State::Write))
    }

    #[inline(never)]
    fn fail(&mut self, cause: Cause) {
        let repair = self.writes() > 0 && matches!(self.request, Request::WriteEeprom { .. });
        self.state = State::Ended(Err(Failure { cause, writes: self.writes(), repair }));
    }

    /// The first place that does not hold what was written.
    fn difference(&self, seen: &Response) -> Option<Cause> {
        let differs = |(word, (wanted, seen)): (u8, (u16, u16))| {
            (wanted != seen).then_some(Cause::NotTaken { word, wanted, seen })
        };
        match (&self.request, seen) {
            (Request::WriteEeprom { start, words }, Response::ReadEeprom { words: seen, .. }) => {
                (*start..=u8::MAX).zip(words.iter().zip(seen.iter())).find_map(differs)
            }
            (Request::WriteRam { start, data }, Response::ReadRam { data: seen, .. }) => {
                let pairs = data.as_slice().iter().zip(seen.as_slice());
                let pairs = pairs.map(|(&wanted, &seen)| (u16::from(wanted), u16::from(seen)));
                (*start..=u8::MAX).zip(pairs).find_map(differs)
            }
            _ => None,
        }
    }
}

impl Operation for RawWrite {
    type Protocol = UnprotectedIsu;
    type Event = core::convert::Infallible;
    type Report = ();
    type Error = Failure;

    fn next(&mut self, _: Instant) -> StepOf<Self> {
        if self.cancelled && matches!(self.state, State::Write) {
            self.fail(Cause::Cancelled);
        }
        let address = self.address;
        match self.state {
            State::Write => Step::Ask { address, request: self.request, tries: 1 },
            State::Read => Step::Ask { address, request: self.read_back(), tries: READ_TRIES },
            State::Ended(_) => Step::Done,
        }
    }

    fn result(&self) -> Option<Result<Self::Report, Self::Error>> {
        match self.state {
            State::Ended(result) => Some(result),
            _ => None,
        }
    }

    fn on(&mut self, outcome: &ExchangeOutcome<UnprotectedIsu>) -> Option<Self::Event> {
        match self.state {
            State::Write => self.state = State::Read,
            State::Read => match response(self.read_back().function(), self.address, &outcome.result) {
                Ok(seen) => match self.difference(seen) {
                    None => self.state = State::Ended(Ok(())),
                    Some(cause) => self.fail(cause),
                },
                Err(cause) => self.fail(cause),
            },
            State::Ended(_) => {}
        }
        None
    }

    fn progress(&self) -> TaskProgress {
        match self.state {
            State::Write => TaskProgress::new(0, 2),
            State::Read => TaskProgress::new(1, 2),
            State::Ended(_) => TaskProgress::new(2, 2),
        }
    }

    fn cancel(&mut self) {
        self.cancelled = true;
    }
}

impl core::fmt::Display for RawRefusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NotAWrite(function) => write!(f, "{function:?} writes nothing"),
            Self::Encode(error) => write!(f, "{error}"),
            Self::TooLong { characters, max } => {
                write!(f, "the command has {characters} characters, at most {max} fit")
            }
        }
    }
}

impl core::error::Error for RawRefusal {}
