//! `isu scan`: every module address is asked for its angle. The document knows no command that lists modules.

use std::convert::Infallible;

use clino_bus::{ExchangeOutcome, Instant, Isu};
use clino_codec::isu::{Address, DeviceError, Request, Response};
use clino_commissioning::{Operation, Step, StepOf, TaskProgress};

/// Addresses of modules. Source: AN #201 §4.
const FIRST: u8 = 1;
const LAST: u8 = 14;
/// The same command again would have to wait 400 ms for a late answer: the whole sweep is repeated instead, if it finds nothing.
const TRIES: u8 = 1;

/// A module that answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FoundModule {
    pub address: Address,
    /// 0.001°; none from a module in its Hard Error state.
    pub mdeg: Option<i32>,
}

/// What was asked, and how many answered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Hunted {
    pub devices: u8,
    /// Something unintelligible answered.
    pub suspects: u8,
    pub asked: u8,
    pub complete: bool,
}

/// Asks every address.
#[derive(Clone, Copy, Debug)]
pub struct Hunt {
    next: u8,
    is_cancelled: bool,
    hunted: Hunted,
}

impl Hunt {
    /// From the first address to the last.
    pub fn new() -> Self {
        Self { next: FIRST, is_cancelled: false, hunted: Hunted::default() }
    }
}

impl Operation for Hunt {
    type Protocol = Isu;
    type Event = FoundModule;
    type Report = Hunted;
    type Error = Infallible;

    fn next(&mut self, _: Instant) -> StepOf<Self> {
        match Address::new(self.next).filter(|_| self.next <= LAST && !self.is_cancelled) {
            Some(address) => Step::Ask { address, request: Request::READ_ANGLE, tries: TRIES },
            None => Step::Done,
        }
    }

    fn result(&self) -> Option<Result<Hunted, Infallible>> {
        Some(Ok(Hunted { complete: self.next > LAST, ..self.hunted }))
    }

    fn on(&mut self, outcome: &ExchangeOutcome<Isu>) -> Option<FoundModule> {
        let address = Address::new(self.next)?;
        self.next += 1;
        self.hunted.asked += 1;
        let mdeg = match &outcome.result {
            Ok(answer) => match &answer.response {
                Response::Error(DeviceError::HardwareError { .. }) => None,
                response => Some(clino_codec::angle::Angle::from_turn16(response.angle_word()?).mdeg()),
            },
            Err(clino_bus::Fault::NoAnswer { .. }) => return None,
            Err(_) => {
                self.hunted.suspects += 1;
                return None;
            }
        };
        self.hunted.devices += 1;
        Some(FoundModule { address, mdeg })
    }

    fn progress(&self) -> TaskProgress {
        TaskProgress { done: u16::from(self.hunted.asked), of: u16::from(LAST) }
    }

    fn cancel(&mut self) {
        self.is_cancelled = true;
    }
}
