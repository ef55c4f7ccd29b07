//! An operation of `clino-commissioning`, run to its end.
//!
//! A task owns the operation; the exchanges that it asks for are led like any other. Blocking and async differ in what
//! waits.

use core::ops::ControlFlow;

use clino_bus::{Duration, ExchangeOutcome, Fault, Prepared, Serial, Timing};
use clino_codec::character::Character;
use clino_commissioning::{Commissionable, Operation, Step};

use super::phases::Exchange;
use super::{Ended, Exchanges, Failure, Sensor};
use crate::Port;
use crate::run::RunError;

/// An operation, and what came of its exchanges.
struct Task<O, E> {
    operation: O,
    /// The first error of the port. The operation takes it for a frame that was not sent.
    port: Option<E>,
}

/// What an operation came to.
type Result<O, E> = core::result::Result<<O as Operation>::Report, RunError<<O as Operation>::Error, E>>;

/// What to do next.
enum Todo<S: Sensor, R> {
    Exchange(Asked<S>),
    /// Say that what was to be asked is no request.
    Refuse,
    /// Listen for this long.
    Wait(Duration),
    /// Run at this bit rate.
    Rate(Serial),
    Done(R),
}

/// An exchange that the operation asks for.
struct Asked<S: Sensor> {
    request: Prepared<S>,
    /// How often, until there is an answer.
    tries: u8,
    /// Any number of answers may begin within this.
    window: Option<Duration>,
}

impl<S: Sensor> Asked<S> {
    fn exchange<'a>(&'a self, all: &'a mut Exchanges<S>, tried: u8) -> Exchange<'a, S> {
        let exchange = Exchange::new(all, &self.request).after(tried);
        match self.window {
            Some(window) => exchange.collecting(window),
            None => exchange,
        }
    }
}

impl<O, E> Task<O, E>
where
    O: Operation,
    O::Protocol: Sensor + Commissionable,
{
    fn new(operation: O) -> Self {
        Self { operation, port: None }
    }

    fn next(&mut self, all: &Exchanges<O::Protocol>) -> Todo<O::Protocol, Result<O, E>> {
        match self.operation.next(all.clock.now) {
            Step::Ask { address, request, tries } => Self::ask(Prepared::new(address, &request), tries, None),
            Step::Collect { address, request, window } => {
                Self::ask(Prepared::new(address, &request), 1, Some(window))
            }
            Step::Wait { until } => Todo::Wait(until.since(all.clock.now)),
            Step::Serial(serial) => Todo::Rate(serial),
            Step::Done => Todo::Done(match self.operation.result() {
                Some(Ok(report)) => Ok(report),
                Some(Err(failure)) => Err(match self.port.take() {
                    Some(error) => RunError::Port { error, failure },
                    None => RunError::Failed(failure),
                }),
                None => Err(RunError::NoResult),
            }),
        }
    }

    fn ask<F, R>(
        request: core::result::Result<Prepared<O::Protocol>, F>,
        tries: u8,
        window: Option<Duration>,
    ) -> Todo<O::Protocol, R> {
        request.map_or(Todo::Refuse, |request| Todo::Exchange(Asked { request, tries, window }))
    }

    /// What was to be asked is no request: no exchange begins.
    fn refuse(&mut self, all: &Exchanges<O::Protocol>) -> Option<O::Event> {
        self.operation.on(&ExchangeOutcome { result: Err(Fault::NotSent), at: all.clock.now })
    }

    /// Takes what an exchange came to. `None`: it is worth another try.
    fn settle(
        &mut self,
        all: &Exchanges<O::Protocol>,
        ended: Ended<O::Protocol, E>,
        may_repeat: bool,
    ) -> Option<Option<O::Event>> {
        let result = ended.unwrap_or_else(|failure| {
            if let Failure::Port(error) = failure {
                self.port.get_or_insert(error);
            }
            Err(Fault::NotSent)
        });
        let failed = result.as_ref().map_or(true, O::Protocol::heard_damaged);
        if failed && may_repeat {
            return None;
        }
        Some(self.operation.on(&ExchangeOutcome { result, at: all.clock.now }))
    }
}

impl<S: Sensor + Commissionable> Exchanges<S> {
    /// A character that belongs to no exchange came within the span that is listened to.
    fn overhear(&mut self, character: Character, after: Duration) -> ControlFlow<()> {
        let at = self.clock.now + after;
        // Outcomes are those of an exchange in hand, and there is none.
        let _ = self.master.heard(character, at);
        ControlFlow::Continue(())
    }

    /// Runs an operation on a blocking port. `rate` sets the bit rate and says which waits go with it; `tell` takes what
    /// the operation reports before its end.
    pub fn run<O: Operation<Protocol = S>, P: Port>(
        &mut self,
        port: &mut P,
        operation: O,
        mut rate: impl FnMut(&mut P, Serial) -> core::result::Result<Timing, P::Error>,
        mut tell: impl FnMut(O::Event),
    ) -> Result<O, P::Error> {
        let mut task = Task::new(operation);
        loop {
            let asked = match task.next(self) {
                Todo::Exchange(asked) => asked,
                Todo::Refuse => {
                    task.refuse(self).into_iter().for_each(&mut tell);
                    continue;
                }
                Todo::Wait(span) => {
                    let _ = port.listen(span, |character, after| self.overhear(character, after));
                    self.pass(span);
                    continue;
                }
                Todo::Rate(serial) => {
                    match rate(port, serial) {
                        Ok(timing) => self.set_timing(timing),
                        Err(error) => _ = task.port.get_or_insert(error),
                    }
                    continue;
                }
                Todo::Done(result) => return result,
            };
            for tried in 0..asked.tries.max(1) {
                let ended = super::lead(&mut asked.exchange(self, tried), port, |outcome| {
                    task.operation.on(outcome).into_iter().for_each(&mut tell);
                });
                let may_repeat = tried.saturating_add(1) < asked.tries;
                if let Some(event) = task.settle(self, ended, may_repeat) {
                    event.into_iter().for_each(&mut tell);
                    break;
                }
            }
        }
    }

    /// Likewise, on an async port.
    #[cfg(feature = "async")]
    pub async fn run_async<O: Operation<Protocol = S>, P: crate::AsyncPort>(
        &mut self,
        port: &mut P,
        operation: O,
        mut rate: impl AsyncFnMut(&mut P, Serial) -> core::result::Result<Timing, P::Error>,
        mut tell: impl FnMut(O::Event),
    ) -> Result<O, P::Error> {
        let mut task = Task::new(operation);
        loop {
            let asked = match task.next(self) {
                Todo::Exchange(asked) => asked,
                Todo::Refuse => {
                    task.refuse(self).into_iter().for_each(&mut tell);
                    continue;
                }
                Todo::Wait(span) => {
                    let _ = port.listen(span, |character, after| self.overhear(character, after)).await;
                    self.pass(span);
                    continue;
                }
                Todo::Rate(serial) => {
                    match rate(port, serial).await {
                        Ok(timing) => self.set_timing(timing),
                        Err(error) => _ = task.port.get_or_insert(error),
                    }
                    continue;
                }
                Todo::Done(result) => return result,
            };
            for tried in 0..asked.tries.max(1) {
                let mut exchange = asked.exchange(self, tried);
                let ended = super::lead_async(&mut exchange, port, |outcome| {
                    task.operation.on(outcome).into_iter().for_each(&mut tell);
                })
                .await;
                let may_repeat = tried.saturating_add(1) < asked.tries;
                if let Some(event) = task.settle(self, ended, may_repeat) {
                    event.into_iter().for_each(&mut tell);
                    break;
                }
            }
        }
    }
}
