//! Operations of one exchange.

use clino_bus::{ExchangeOutcome, Instant, Isu};
use clino_codec::angle::Angle;
use clino_codec::isu::{Address, Request, Response};

use super::talk::response;
use super::{Cause, Failure, Module};
use crate::{Operation, READ_TRIES, Step, StepOf, TaskProgress};

/// One question that may be asked again without harm.
#[derive(Clone, Copy, Debug)]
pub struct Question<T> {
    address: Address,
    request: &'static Request,
    /// The answer's content, if it is the one.
    take: fn(&Response) -> Option<T>,
    ended: Option<Result<T, Cause>>,
}

/// Reads the angle, 0…359.99° from the null position. A new one appears every 8/15 s; in the Soft Error state it is the
/// last one before the error.
pub type ReadAngle = Question<Angle>;

/// Takes a module out of its Hard Error state, so that it talks again; it does not measure. No effect in any other.
pub type GoToSoftError = Question<()>;

impl Question<Angle> {
    /// Asks for the angle.
    pub const fn new(module: Module) -> Self {
        let take = |response: &Response| response.angle_word().map(Angle::from_turn16);
        Question { address: module.address(), request: &Request::READ_ANGLE, take, ended: None }
    }
}

impl Question<()> {
    /// Asks for the Soft Error state.
    pub const fn new(module: Module) -> Self {
        let take = |response: &Response| matches!(response, Response::GoToSoftErrorState).then_some(());
        Question { address: module.address(), request: &Request::GoToSoftErrorState, take, ended: None }
    }
}

impl<T: Copy> Operation for Question<T> {
    type Protocol = Isu;
    type Event = core::convert::Infallible;
    type Report = T;
    type Error = Failure;

    fn next(&mut self, _: Instant) -> StepOf<Self> {
        match self.ended {
            None => Step::Ask { address: self.address, request: *self.request, tries: READ_TRIES },
            Some(_) => Step::Done,
        }
    }

    fn result(&self) -> Option<Result<Self::Report, Self::Error>> {
        self.ended.map(|result| result.map_err(|cause| Failure { cause, writes: 0, repair: false }))
    }

    fn on(&mut self, outcome: &ExchangeOutcome<Isu>) -> Option<Self::Event> {
        let result = match response(self.request.function(), self.address, &outcome.result) {
            Ok(response) => Ok((self.take)(response)?),
            Err(cause) => Err(cause),
        };
        self.ended = Some(result);
        None
    }

    fn progress(&self) -> TaskProgress {
        TaskProgress::new(u16::from(self.ended.is_some()), 1)
    }

    fn cancel(&mut self) {
        self.ended.get_or_insert(Err(Cause::Cancelled));
    }
}
