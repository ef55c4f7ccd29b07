//! The whole EEPROM of a module, word by word: for `isu eeprom dump` and `audit`. Nothing is written.
//!
//! The image is read twice: one byte changed on the line is always noticed, several can cancel out in an 8-bit sum.

use std::convert::Infallible;

use clino_bus::{ExchangeOutcome, Instant, Isu};
use clino_codec::isu::eeprom::Image;
use clino_codec::isu::{Address, DeviceError, Function, Request, Response};
use clino_commissioning::isu::{Cause, Failure};
use clino_commissioning::{Operation, READ_TRIES, Step, StepOf, TaskProgress};

/// Words of an EEPROM.
pub const WORDS: usize = 256;
/// Words of an answer: 35 bytes, 37 ms on the line.
const CHUNK: u8 = 16;
/// Answers of a reading.
const CHUNKS: u16 = WORDS as u16 / CHUNK as u16;
/// Readings that have to agree.
const READINGS: u16 = 2;

/// Reads it.
#[derive(Clone, Debug)]
pub struct ReadEeprom {
    address: Address,
    image: Image,
    /// Chunks read, of all readings.
    done: u16,
    /// Two readings were not the same.
    differs: bool,
    failed: Option<Cause>,
}

/// All words; `is_agreed` if both readings were the same.
#[derive(Clone, Debug)]
pub struct Dumped {
    pub image: Image,
    pub is_agreed: bool,
}

impl ReadEeprom {
    /// Of the module at this address.
    pub fn new(address: Address) -> Self {
        Self { address, image: Image::new([0; WORDS]), done: 0, differs: false, failed: None }
    }

    fn start(&self) -> u8 {
        // Below 256.
        (self.done % CHUNKS) as u8 * CHUNK
    }
}

impl Operation for ReadEeprom {
    type Protocol = Isu;
    type Event = Infallible;
    type Report = Dumped;
    type Error = Failure;

    fn next(&mut self, _: Instant) -> StepOf<Self> {
        if self.failed.is_some() || self.done >= CHUNKS * READINGS {
            return Step::Done;
        }
        let request = Request::ReadEeprom { start: self.start(), count: CHUNK };
        Step::Ask { address: self.address, request, tries: READ_TRIES }
    }

    fn result(&self) -> Option<Result<Dumped, Failure>> {
        Some(match self.failed {
            Some(cause) => Err(Failure { cause, writes: 0, repair: false }),
            None => Ok(Dumped { image: self.image.clone(), is_agreed: !self.differs }),
        })
    }

    fn on(&mut self, outcome: &ExchangeOutcome<Isu>) -> Option<Infallible> {
        let (function, address) = (Function::ReadEeprom, self.address);
        match &outcome.result {
            Ok(answer) => match &answer.response {
                Response::ReadEeprom { start, words } => {
                    for (place, word) in (*start..=u8::MAX).zip(words.iter()) {
                        self.differs |= self.done >= CHUNKS && self.image.word(place) != word;
                    }
                    self.image.fill(*start, words.iter());
                    self.done += 1;
                }
                Response::Error(DeviceError::HardwareError { .. }) => self.failed = Some(Cause::HardError),
                Response::Error(error) => self.failed = Some(Cause::Device { function, error: *error }),
                _ => self.failed = Some(Cause::Cancelled),
            },
            Err(fault) => self.failed = Some(Cause::NoAnswer { function, address, fault: *fault }),
        }
        None
    }

    fn progress(&self) -> TaskProgress {
        TaskProgress { done: self.done, of: CHUNKS * READINGS }
    }

    fn cancel(&mut self) {
        self.failed.get_or_insert(Cause::Cancelled);
    }
}
