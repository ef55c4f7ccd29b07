//! One question to a T7, as an operation: the crate has one for each task, and reading a value is none.

use std::convert::Infallible;

use clino_bus::{ExchangeOutcome, Instant, T7};
use clino_codec::t7::{Address, Request, Response};
use clino_commissioning::t7::{Cause, Failure};
use clino_commissioning::{Operation, READ_TRIES, Step, StepOf, TaskProgress};

/// Asks a device one thing that changes nothing.
#[derive(Clone, Copy, Debug)]
pub struct AskT7 {
    address: Address,
    request: Request,
    ended: Option<Result<Response, Cause>>,
}

impl AskT7 {
    /// A request that reads, to one device.
    pub const fn new(address: Address, request: Request) -> Self {
        Self { address, request, ended: None }
    }
}

impl Operation for AskT7 {
    type Protocol = T7;
    type Event = Infallible;
    type Report = Response;
    type Error = Failure;

    fn next(&mut self, _: Instant) -> StepOf<Self> {
        match self.ended {
            None => Step::Ask { address: self.address, request: self.request, tries: READ_TRIES },
            Some(_) => Step::Done,
        }
    }

    fn result(&self) -> Option<Result<Self::Report, Self::Error>> {
        self.ended.map(|result| result.map_err(|cause| Failure { cause, writes: 0 }))
    }

    fn on(&mut self, outcome: &ExchangeOutcome<T7>) -> Option<Infallible> {
        let (opcode, address) = (self.request.opcode(), self.address);
        let result = outcome.result.map(|answer| answer.response);
        self.ended = Some(result.map_err(|fault| Cause::NoAnswer { opcode, address, fault }));
        None
    }

    fn progress(&self) -> TaskProgress {
        TaskProgress { done: self.ended.is_some().into(), of: 1 }
    }

    fn cancel(&mut self) {
        self.ended.get_or_insert(Err(Cause::Cancelled));
    }
}
