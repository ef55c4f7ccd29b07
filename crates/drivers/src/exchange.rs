//! One request and its answer on a [`Port`]: the code shared by blocking and async drivers.
//!
//! ```text
//!  Settling ──────────▶ Guarding ────────▶ Sending ────▶ Waiting ────▶ over
//!  late answers,        the guard's         port.send     the answer, or the
//!  half-sent frames     silence                           master's deadline
//! ```
//!
//! Deadlines, late answers and the quiet time are those of the bus's [`Master`]; this adds what stands between it and a
//! port without a clock.
//!
//! Time is what the port has waited. Between calls, and while the code itself runs, it stands still: every wait lasts
//! at least as long as its figure, and longer by what the code takes. Received characters prove the passing of time,
//! too: `n` of them take as long as `n` characters last, so that no babble lasts for ever on a slow processor.

mod phases;
#[cfg(feature = "commissioning")]
mod task;
mod witness;

use clino_bus::{
    Duration, ExchangeOutcome, Fault, Instant, Isu, Master, Prepared, Protocol, Retry, T7, Timing,
};

use crate::{Port, Suspect};
use phases::{Exchange, Step};
use witness::{Heard, History};

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
    now: Instant,
    /// The driver of the last frame went off.
    released: Instant,
    /// The characters heard since take so long that it is this late at least when the next one is heard.
    proven: Instant,
    /// What was heard since.
    witness: Heard,
    history: History,
    /// The last frame did not get out whole.
    half_sent: bool,
    /// There is one sensor on the line, and no other.
    single: bool,
    /// The longest wait in one piece, where the port cannot say when a character came.
    piece: Option<Duration>,
    retry: Retry,
}

impl<S: Sensor> Exchanges<S> {
    /// For a port that says when a character came.
    #[inline(never)]
    pub fn new(timing: Timing, single: bool) -> Self {
        let (now, released, proven) = (Instant::ZERO, Instant::ZERO, Instant::ZERO);
        let (witness, history) = (Heard::default(), History::default());
        Self {
            master: Master::new(timing),
            now,
            released,
            proven,
            witness,
            history,
            half_sent: false,
            single,
            piece: None,
            retry: Retry::NEVER,
        }
    }

    /// For a port that only knows in which span a character came.
    #[cfg(feature = "async")]
    pub fn in_pieces(timing: Timing, single: bool) -> Self {
        Self { piece: Some(timing.gap), ..Self::new(timing, single) }
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
        self.piece = self.piece.map(|_| timing.gap);
        self.master.set_timing(timing);
    }

    /// How often to repeat from the next exchange on.
    pub fn set_retry(&mut self, retry: Retry) {
        self.retry = retry;
    }

    /// So much time has passed besides what the port has waited.
    pub fn pass(&mut self, span: Duration) {
        self.now = self.now + span;
        // What was in hand, if a future was dropped, may have passed its deadline.
        let _ = self.master.lapse(self.now);
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
