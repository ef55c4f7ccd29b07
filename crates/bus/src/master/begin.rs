//! How an exchange begins, and when it may.

use super::exchange::{Collecting, Exchange};
use super::{Master, State};
use crate::counters::bump;
use crate::{Duration, Instant, Protocol};

impl<P: Protocol> Master<P> {
    /// From when on this request may be asked so that its answer can be told from late ones: [`Instant::ZERO`] for at
    /// once, `None` while an exchange is in hand.
    pub fn ask_at(&self, address: P::Address, request: &P::Request) -> Option<Instant> {
        let expected = P::expected(address, request);
        let on_the_list = self.outstanding.clear_at(&expected);
        match self.state {
            State::Idle => Some(on_the_list),
            State::Sending { .. } | State::Waiting { .. } => None,
            State::Quiet { clear, outstanding, .. } => {
                let failed = self.exchange.as_ref().map(|exchange| &exchange.expected);
                let confusable = failed.is_some_and(|failed| P::confusable(&expected, failed));
                let last = outstanding.filter(|_| confusable).unwrap_or(Instant::ZERO);
                Some(on_the_list.max(clear).max(last))
            }
        }
    }

    /// Whether this request may be asked at `now`. That may be before [`Master::is_idle`], after a request that failed
    /// and cannot be confused with this one.
    pub fn may_ask(&self, address: P::Address, request: &P::Request, now: Instant) -> bool {
        self.ask_at(address, request).is_some_and(|at| at <= now)
    }

    /// Opens an exchange and returns the frame to submit to the line. An exchange in hand is given up. Of a request
    /// that is asked before it [may be](Master::may_ask), answers are counted as late and not used.
    ///
    /// # Errors
    /// The request cannot be put into a frame; nothing has begun then.
    pub fn begin(
        &mut self,
        address: P::Address,
        request: &P::Request,
        now: Instant,
    ) -> Result<P::Frame, P::EncodeError> {
        self.open(address, request, Kind::First, now)
    }

    /// As [`Master::begin`], for a repetition of a request that failed: it is counted as such.
    ///
    /// # Errors
    /// As [`Master::begin`].
    pub fn begin_retry(
        &mut self,
        address: P::Address,
        request: &P::Request,
        now: Instant,
    ) -> Result<P::Frame, P::EncodeError> {
        self.open(address, request, Kind::Retry, now)
    }

    /// As [`Master::begin`], for a request that any number of nodes may answer: until `window` after our last stop
    /// bit, and at least for as long as one node may take to answer, every good answer and every bad frame is an outcome of
    /// its own. What begins in the window is heard to its end. The last outcome, and only that, is [`Fault::Over`](super::Fault::Over); or, when the request did not get
    /// out, the only outcome says so.
    ///
    /// # Errors
    /// As [`Master::begin`].
    pub fn begin_collecting(
        &mut self,
        address: P::Address,
        request: &P::Request,
        window: Duration,
        now: Instant,
    ) -> Result<P::Frame, P::EncodeError> {
        self.open(address, request, Kind::Collecting(window), now)
    }

    /// The node that was just asked may take so long to begin its answer, whatever its document says. To be called
    /// before its request is out.
    pub fn allow(&mut self, latency: Duration) {
        if let (State::Sending { .. }, Some(exchange)) = (self.state, &mut self.exchange) {
            exchange.latency = latency;
        }
    }

    #[inline(never)]
    fn open(
        &mut self,
        address: P::Address,
        request: &P::Request,
        kind: Kind,
        now: Instant,
    ) -> Result<P::Frame, P::EncodeError> {
        let frame = P::encode(address, request);
        if let Ok(frame) = &frame {
            self.opened(P::expected(address, request), request, kind, frame.as_ref().len(), now);
        }
        frame
    }

    /// An exchange begins with a frame of this many characters.
    fn opened(
        &mut self,
        expected: P::Expected,
        request: &P::Request,
        kind: Kind,
        characters: usize,
        now: Instant,
    ) {
        self.leave(now);
        self.adaptive.count();
        bump(&mut self.counters.requests);
        if P::writes(request) {
            bump(&mut self.counters.writes);
        }
        if matches!(kind, Kind::Retry) {
            bump(&mut self.counters.retries);
        }
        let collecting = match kind {
            Kind::Collecting(window) => Some(Collecting::new(window)),
            _ => None,
        };
        let latency = P::latency(request, &self.timing);
        let retry = matches!(kind, Kind::Retry);
        match &mut self.exchange {
            Some(exchange) => exchange.restart(expected, latency, retry, collecting, now),
            None => self.open_first(expected, latency, retry, collecting, now),
        }
        // The line reports how the frame ended; this deadline, twice what it may take, covers one that does not.
        let longest = self.timing.line_busy + self.character.times(characters as u32);
        self.state = State::Sending { give_up: now + longest.times(2) };
    }

    /// The first exchange of all. A function of its own, for what is made in it is large and the others are begun without.
    #[inline(never)]
    fn open_first(
        &mut self,
        expected: P::Expected,
        latency: Duration,
        retry: bool,
        collecting: Option<Collecting>,
        now: Instant,
    ) {
        self.exchange = Some(Exchange::new(expected, latency, retry, collecting, now));
    }

    /// Leaves the state at hand for a new exchange.
    #[inline(never)]
    fn leave(&mut self, now: Instant) {
        if self.is_asking()
            && let Some(exchange) = &self.exchange
        {
            let until = now + exchange.latency + self.timing.late;
            self.outstanding.add(exchange.outstanding(until), now);
        }
        self.leave_quiet(now);
    }
}

/// What kind of exchange begins.
#[derive(Clone, Copy)]
enum Kind {
    First,
    Retry,
    Collecting(Duration),
}
