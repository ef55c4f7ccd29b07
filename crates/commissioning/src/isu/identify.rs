//! Where a module is, how it is set up, whether its EEPROM is sound.

use clino_bus::{ExchangeOutcome, Instant, Isu};
use clino_codec::angle::Angle;
use clino_codec::isu::eeprom::{Audit, DataWord};
use clino_codec::isu::{Address, Request, Response};

use super::image::Reader;
use super::talk::response;
use super::{Cause, Failure, Module};
use crate::{Operation, READ_TRIES, Step, StepOf, TaskProgress};

/// Reads the angle and the whole EEPROM. Changes nothing.
#[derive(Clone, Debug)]
pub struct Identify {
    address: Address,
    angle: Option<Angle>,
    reader: Reader,
    failed: Option<Cause>,
}

/// Where a module is and how it is set up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Identity {
    /// As stored; 0 as it leaves the factory.
    pub address: Address,
    /// From the null position.
    pub angle: Angle,
    /// Where the angle is zero.
    pub null_position: Angle,
    /// The data word with the auto-shutoff bit. Which bit that is cannot be read in the available copy of the document.
    pub auto_shutoff_word: u16,
    /// The EEPROM's checksum.
    pub audit: Audit,
}

impl Identify {
    /// Begins with the angle. A module in its Hard Error state is left in it.
    // As `Reader::new`.
    #[inline(always)]
    pub const fn new(module: Module) -> Identify {
        Identify { address: module.address(), angle: None, reader: Reader::new(), failed: None }
    }

    fn request(&self) -> Option<Request> {
        if self.angle.is_none() { Some(Request::READ_ANGLE) } else { self.reader.request() }
    }
}

impl Operation for Identify {
    type Protocol = Isu;
    type Event = core::convert::Infallible;
    type Report = Identity;
    type Error = Failure;

    fn next(&mut self, _: Instant) -> StepOf<Self> {
        match self.request().filter(|_| self.failed.is_none()) {
            Some(request) => Step::Ask { address: self.address, request, tries: READ_TRIES },
            None => Step::Done,
        }
    }

    fn result(&self) -> Option<Result<Self::Report, Self::Error>> {
        if let Some(cause) = self.failed {
            return Some(Err(Failure { cause, writes: 0, repair: false }));
        }
        let image = &self.reader.image;
        self.request().is_none().then(|| {
            Ok(Identity {
                address: image.module_address(),
                angle: self.angle.unwrap_or(Angle::ZERO),
                null_position: image.null_position(),
                auto_shutoff_word: image.data(DataWord::AutoShutoff),
                audit: image.audit(),
            })
        })
    }

    fn on(&mut self, outcome: &ExchangeOutcome<Isu>) -> Option<Self::Event> {
        let function = self.request()?.function();
        match response(function, self.address, &outcome.result) {
            Ok(Response::ReadEeprom { start, words }) => self.reader.take(*start, words),
            Ok(response) => self.angle = self.angle.or(response.angle_word().map(Angle::from_turn16)),
            Err(cause) => self.failed = Some(cause),
        }
        None
    }

    fn progress(&self) -> TaskProgress {
        let of = Reader::EXCHANGES.saturating_add(1);
        let done = u16::from(self.angle.is_some()).saturating_add(self.reader.done());
        TaskProgress::new(if self.failed.is_some() { of } else { done }, of)
    }

    fn cancel(&mut self) {
        if self.request().is_some() {
            self.failed.get_or_insert(Cause::Cancelled);
        }
    }
}
