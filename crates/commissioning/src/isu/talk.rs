//! The conversation with a module that may change its address, or fall into its Hard Error state, on the way.

use clino_bus::{ExchangeOutcome, Isu};
use clino_codec::isu::{Address, Answer, DeviceError, Function, Request, Response};

use super::{Cause, Fault};
use crate::{READ_TRIES, Step};

/// How often a module is taken out of its Hard Error state in one operation.
const SOFTENINGS: u8 = 4;

/// Which module to ask, and what has to be asked first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Talk {
    /// Where it answers, as far as is known.
    pub at: Address,
    /// Where else it may be.
    pub other: Option<Address>,
    /// It has to be taken out of its Hard Error state first.
    softening: bool,
    softened: u8,
}

/// What an answer comes to.
#[derive(Clone, Copy, Debug)]
pub(super) enum Said<'a> {
    Response(&'a Response),
    /// It has to be asked again: somewhere else, or after something else.
    Again,
    Failed(Cause),
}

/// The response, or why there is none.
pub(super) fn response(
    function: Function,
    address: Address,
    result: &Result<Answer, Fault>,
) -> Result<&Response, Cause> {
    match result {
        Ok(answer) => match &answer.response {
            Response::Error(DeviceError::HardwareError { .. }) => Err(Cause::HardError),
            Response::Error(error) => Err(Cause::Device { function, error: *error }),
            response => Ok(response),
        },
        Err(fault) => Err(Cause::NoAnswer { function, address, fault: *fault }),
    }
}

impl Talk {
    pub const fn new(at: Address) -> Talk {
        Talk { at, other: None, softening: false, softened: 0 }
    }

    /// The step that asks `request`, or what has to come first.
    pub const fn ask(&self, request: Request, tries: u8) -> Step<Address, Request> {
        match self.softening {
            true => Step::Ask { address: self.at, request: Request::GoToSoftErrorState, tries: READ_TRIES },
            false => Step::Ask { address: self.at, request, tries },
        }
    }

    /// Go To Soft Error State comes first.
    pub fn soften(&mut self) {
        self.softened = self.softened.saturating_add(1);
        self.softening = true;
    }

    /// Whether it has been found in its Hard Error state.
    pub const fn was_in_hard_error(&self) -> bool {
        self.softened > 0
    }

    /// Whether the exchange under way is Go To Soft Error State.
    pub const fn is_softening(&self) -> bool {
        self.softening
    }

    /// The end of an exchange that was begun with [`ask`](Self::ask). A module in its Hard Error state is taken out of
    /// it; one that is silent is sought at its other address, once.
    pub fn settle<'a>(&mut self, function: Function, outcome: &'a ExchangeOutcome<Isu>) -> Said<'a> {
        let function = if self.softening { Function::GoToSoftErrorState } else { function };
        match response(function, self.at, &outcome.result) {
            Ok(Response::GoToSoftErrorState) if self.softening => {
                self.softening = false;
                Said::Again
            }
            Ok(response) => Said::Response(response),
            Err(Cause::HardError) if self.softened < SOFTENINGS => {
                self.soften();
                Said::Again
            }
            Err(cause @ Cause::NoAnswer { fault: Fault::NoAnswer { .. }, .. }) => match self.other.take() {
                Some(other) => {
                    self.at = other;
                    Said::Again
                }
                None => Said::Failed(cause),
            },
            Err(cause) => Said::Failed(cause),
        }
    }

    /// The end of a write. Whether it happened, reading will show.
    pub fn settle_write(&mut self, outcome: &ExchangeOutcome<Isu>) {
        if let Ok(answer) = &outcome.result
            && let Response::Error(DeviceError::HardwareError { .. }) = answer.response
        {
            self.soften();
        }
    }
}
