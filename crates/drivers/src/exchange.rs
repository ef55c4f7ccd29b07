//! One request and its answer on a [`Port`]: the code shared by blocking and async drivers.
//!
//! ```text
//!  Settling ──────────▶ Guarding ────────▶ Sending ────▶ Waiting ────▶ over
//!  late answers,        the guard's         port.send     the answer, or the
//!  half-sent frames     silence                           master's deadline
//! ```
//!
//! Deadlines, late answers and the quiet time are those of the bus's [`Master`]; this adds what stands between it and a
//! port without a clock, and its own reckoning of time (`exchange/clock.rs`).

mod clock;
mod phases;
#[cfg(feature = "commissioning")]
mod task;
mod witness;

use clino_bus::{Duration, ExchangeOutcome, Fault, Isu, Master, Prepared, Protocol, Retry, T7, Timing};

use crate::{Port, Suspect};
use clock::Clock;
use phases::{Exchange, Step};

/// What a driver has to know besides the protocol.
pub trait Sensor: Protocol {
    /// A sensor that heard a frame begin waits so long for its end, and takes what we send meanwhile for a part of it.
    const COMMAND_TIMEOUT: Duration;

    /// Such a sensor prints lines of text when it is started wrongly.
    const PRINTS_LINES: bool;

    /// Whether all sensors of a line answer to this address.
    fn is_broadcast(address: Self::Address) -> bool;
}

impl Sensor for T7 {
    /// T7 guide section 1.
    const COMMAND_TIMEOUT: Duration = Duration::from_millis(500);
    const PRINTS_LINES: bool = false;

    fn is_broadcast(address: Self::Address) -> bool {
        address.is_all()
    }
}

impl Sensor for Isu {
    /// AN #201 section 4.
    const COMMAND_TIMEOUT: Duration = Duration::from_millis(400);
    const PRINTS_LINES: bool = true;

    fn is_broadcast(address: Self::Address) -> bool {
        address.is_any()
    }
}

/// Why there is no answer.
pub enum Failure<S: Sensor, E> {
    Request(S::EncodeError),
    NotSingleDevice,
    Port(E),
    Fault(Fault<S::DecodeError>, Suspect),
}

/// What lasts from one exchange to the next.
pub struct Exchanges<S: Sensor> {
    master: Master<S>,
    clock: Clock,
    /// There is one sensor on the line, and no other.
    single: bool,
    retry: Retry,
}

impl<S: Sensor> Exchanges<S> {
    /// For a port that says when a character came.
    #[inline(never)]
    pub fn new(timing: Timing, single: bool) -> Self {
        Self { master: Master::new(timing), clock: Clock::new(), single, retry: Retry::NEVER }
    }

    /// For a port that only knows in which span a character came.
    #[cfg(feature = "async")]
    pub fn in_pieces(timing: Timing, single: bool) -> Self {
        let mut all = Self::new(timing, single);
        all.clock.piece = Some(timing.gap);
        all
    }

    /// Whether there is one sensor on the line, and no other.
    #[cfg(feature = "commissioning")]
    pub const fn is_single(&self) -> bool {
        self.single
    }

    pub fn master(&self) -> &Master<S> {
        &self.master
    }

    /// Other waits from the next exchange on.
    pub fn set_timing(&mut self, timing: Timing) {
        self.clock.piece = self.clock.piece.map(|_| timing.gap);
        self.master.set_timing(timing);
    }

    /// How often to repeat from the next exchange on.
    pub fn set_retry(&mut self, retry: Retry) {
        self.retry = retry;
    }

    /// So much time has passed besides what the port has waited.
    pub fn pass(&mut self, span: Duration) {
        self.clock.now = self.clock.now + span;
        // What was in hand, if a future was dropped, may have passed its deadline.
        let _ = self.master.lapse(self.clock.now);
    }

    /// A request that may be sent on this line.
    fn prepare<E>(&self, address: S::Address, request: &S::Request) -> Result<Prepared<S>, Failure<S, E>> {
        if S::is_broadcast(address) && !self.single {
            return Err(Failure::NotSingleDevice);
        }
        Prepared::new(address, request).map_err(Failure::Request)
    }

    /// Asks on a blocking port.
    pub fn ask<P: Port>(
        &mut self,
        port: &mut P,
        address: S::Address,
        request: &S::Request,
    ) -> Result<S::Answer, Failure<S, P::Error>> {
        let request = self.prepare(address, request)?;
        let mut exchange = Exchange::new(self, &request);
        match lead(&mut exchange, port, |_| ())? {
            Ok(answer) => Ok(answer),
            Err(fault) => Err(exchange.failure(fault)),
        }
    }

    /// Asks on an async port. When this is dropped, the next exchange first settles what was begun.
    #[cfg(feature = "async")]
    pub async fn ask_async<P: crate::AsyncPort>(
        &mut self,
        port: &mut P,
        address: S::Address,
        request: &S::Request,
    ) -> Result<S::Answer, Failure<S, P::Error>> {
        let request = self.prepare(address, request)?;
        let mut exchange = Exchange::new(self, &request);
        match lead_async(&mut exchange, port, |_| ()).await? {
            Ok(answer) => Ok(answer),
            Err(fault) => Err(exchange.failure(fault)),
        }
    }
}

/// What an exchange came to, or why it was not carried out.
type Ended<S, E> =
    Result<Result<<S as Protocol>::Answer, Fault<<S as Protocol>::DecodeError>>, Failure<S, E>>;

/// Leads an exchange to its end. One that collects tells each of its answers.
fn lead<S: Sensor, P: Port>(
    exchange: &mut Exchange<'_, S>,
    port: &mut P,
    mut tell: impl FnMut(&ExchangeOutcome<S>),
) -> Ended<S, P::Error> {
    loop {
        match exchange.step() {
            Step::Listen(span) => {
                let listened = port.listen(span, |character, after| exchange.heard(character, after));
                if listened.is_continue() {
                    exchange.passed(span);
                }
            }
            Step::Send => {
                let sent = port.send(exchange.frame());
                exchange.sent(sent.is_ok());
                sent.map_err(Failure::Port)?;
            }
            Step::Partly => tell(&exchange.take()),
            Step::Over => return Ok(exchange.take().result),
        }
    }
}

/// Likewise, on an async port.
#[cfg(feature = "async")]
async fn lead_async<S: Sensor, P: crate::AsyncPort>(
    exchange: &mut Exchange<'_, S>,
    port: &mut P,
    mut tell: impl FnMut(&ExchangeOutcome<S>),
) -> Ended<S, P::Error> {
    loop {
        match exchange.step() {
            Step::Listen(span) => {
                let listened = port.listen(span, |character, after| exchange.heard(character, after));
                if listened.await.is_continue() {
                    exchange.passed(span);
                }
            }
            Step::Send => {
                let sent = port.send(exchange.frame()).await;
                exchange.sent(sent.is_ok());
                sent.map_err(Failure::Port)?;
            }
            Step::Partly => tell(&exchange.take()),
            Step::Over => return Ok(exchange.take().result),
        }
    }
}
