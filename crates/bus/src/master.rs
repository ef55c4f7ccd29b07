//! One request, one answer, one deadline.
//!
//! ```text
//!        begin           Released           first character late, gap too long
//!  Idle ───────▶ Sending ────────▶ Waiting ─────────────────────────────────▶ Quiet ──▶ Idle
//!    ▲                                │ answer                                  │ (late answers are
//!    └────────────────────────────────┴─────────────────────────────────────────┘  counted, never used)
//! ```
//!
//! *Waiting.* The first character has to come within the sensor's documented latency; a dead node costs no more. A
//! character never shortens a wait, so stray characters at turnaround cost nothing; length and checksum make the frame, a gap
//! only ends the wait. However long a node babbles, a wait ends after the longest answer twice over.
//!
//! *Quiet.* After a failure the master sends nothing for [`Timing::quiet`], and for longer if the node usually answers
//! (`engine/history.rs`). After that the master may be asked what cannot be confused with the request that failed
//! ([`Master::may_ask`]): another node, another command. For the same again it is idle only when no late answer can come
//! any more, [`Timing::late`] after the deadline (`engine/late.rs`). So dead nodes are cheap, and a late answer to one
//! request is never the answer to the next, be it the same request to the same node. A caller that does not need this
//! efficiency waits for [`Master::is_idle`]; without the feature `many-nodes` each does.
//!
//! *Slow nodes.* Answers seen to be late prolong the waits, up to [`Timing::extension`] (`engine/adaptive.rs`).

use clino_codec::DecodeProgress;
use clino_codec::character::Character;

use crate::counters::BusCounters;
pub use crate::line::Event;
use crate::protocol::{FailedCheck, Protocol};
use crate::{Duration, Instant, Timing};

mod engine;
mod fault;
mod prepared;

pub use engine::Engine;
pub use engine::ExchangeKind;
use engine::{Due, Framed, Missed, Opening, Refused, Rest};
pub use fault::{Blame, Fault};
pub use prepared::Prepared;

/// How an exchange ended.
#[derive(Debug)]
pub struct ExchangeOutcome<P: Protocol> {
    /// The answer, or why there is none.
    pub result: Result<P::Answer, Fault<P::DecodeError>>,
    /// When it ended: the stop bit of the answer's last character, or the deadline.
    pub at: Instant,
}

/// Master of one bus that speaks `P`. Frames go out through a [`Line`](crate::Line), whose events come in here.
///
/// What is the same for all protocols is in its [`Engine`]; here is the rest, what passes through the decoder.
// In this order: with the outcome before the decoder, both are zeroed elsewhere and copied, with `memcpy`, 0.8 KB.
#[repr(C)]
pub struct Master<P: Protocol> {
    engine: Engine,
    /// Waits for the answer to the request in hand.
    decoder: P::Decoder,
    /// Of the exchange that has ended last; of the one in hand, why the last frame was refused.
    outcome: Option<ExchangeOutcome<P>>,
}

impl<P: Protocol> Master<P> {
    /// A master with nothing in hand. Inlined, for it is large: so it is made where it is to stay.
    #[inline(always)]
    pub fn new(timing: Timing) -> Self {
        Master { engine: Engine::new(timing), decoder: P::decoder(), outcome: None }
    }

    /// The part that is the same for all protocols.
    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    /// The node whose answer came late, once for each. To be called at least once for each request.
    pub fn take_late(&mut self) -> Option<u8> {
        self.engine.take_late()
    }

    /// Whether nothing is in hand, and no late answer to the last request can come any more.
    pub fn is_idle(&self) -> bool {
        self.engine.is_idle()
    }

    /// Whether an exchange is in hand.
    pub fn is_asking(&self) -> bool {
        self.engine.is_asking()
    }

    /// What happened since reset.
    pub fn counters(&self) -> &BusCounters {
        self.engine.counters()
    }

    /// Sets what was counted to zero.
    pub fn clear_counters(&mut self) {
        self.engine.clear_counters();
    }

    /// The waits in force.
    pub fn timing(&self) -> &Timing {
        self.engine.timing()
    }

    /// Changes the waits, for a bus whose bit rate has changed. Takes effect with the next exchange; not to be called
    /// during one.
    pub fn set_timing(&mut self, timing: Timing) {
        self.engine.set_timing(timing);
    }

    /// From when on this request may be asked so that its answer can be told from late ones: [`Instant::ZERO`] for at
    /// once, `None` while an exchange is in hand.
    pub fn ask_at(&self, address: P::Address, request: &P::Request) -> Option<Instant> {
        self.engine.ask_at(&P::reply(&P::expected(address, request)))
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
        self.begin_as(ExchangeKind::First, address, request, now)
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
        self.begin_as(ExchangeKind::Retry, address, request, now)
    }

    /// As [`Master::begin`], for a request that any number of nodes may answer: until `window` after our last stop
    /// bit, and at least for as long as one node may take to answer, every good answer and every bad frame is an outcome of
    /// its own. What begins in the window is heard to its end. The last outcome, and only that, is [`Fault::Over`]; or, when the
    /// request did not get out, the only outcome says so.
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
        self.begin_as(ExchangeKind::Collecting(window), address, request, now)
    }

    #[inline(never)]
    fn begin_as(
        &mut self,
        kind: ExchangeKind,
        address: P::Address,
        request: &P::Request,
        now: Instant,
    ) -> Result<P::Frame, P::EncodeError> {
        let frame = P::encode(address, request)?;
        let expected = P::expected(address, request);
        self.open(&expected, P::writes(request), frame.as_ref().len(), kind, now);
        Ok(frame)
    }

    /// As [`Master::begin`] and its likes, for a request that is a frame already.
    pub fn begin_prepared(&mut self, prepared: &Prepared<P>, kind: ExchangeKind, now: Instant) {
        self.open(&prepared.expected, prepared.writes(), prepared.frame().len(), kind, now);
    }

    fn open(
        &mut self,
        expected: &P::Expected,
        writes: bool,
        characters: usize,
        kind: ExchangeKind,
        now: Instant,
    ) {
        let opening = Opening { expected: P::reply(expected), kind, writes, characters };
        let rest = if self.engine.is_quiet() { self.finish() } else { Rest::default() };
        self.engine.begin(&opening, rest, now);
        self.outcome = None;
        P::restart(&mut self.decoder, *expected);
    }

    /// The node that was just asked may take so long to begin its answer, whatever its document says. To be called
    /// before its request is out.
    pub fn allow(&mut self, latency: Duration) {
        self.engine.allow(latency);
    }

    /// Takes an event of the line. A collecting exchange has more than one outcome.
    pub fn on(&mut self, event: Event) -> Option<ExchangeOutcome<P>> {
        self.observe(event)?;
        self.take_outcome()
    }

    /// As [`Master::on`], for a caller that has no use for an outcome of its own: an ISU's takes up to 280 bytes.
    pub fn observe(&mut self, event: Event) -> Option<&ExchangeOutcome<P>> {
        match event {
            Event::Heard { character, at } => return self.heard(character, at),
            Event::Released { at } => self.released(at),
            Event::Forced { at } => return self.forced(at),
            Event::GivenUp { at } => return self.given_up(at),
            Event::Echo { .. } => self.engine.echoed(),
            Event::Contention { .. } => self.engine.contended(),
        }
        None
    }

    /// What [`Master::observe`] or [`Master::lapse`] has returned last, until it is taken or another exchange begins. Before
    /// an exchange that has one outcome has ended: why its last frame was refused, if one was.
    pub fn outcome(&self) -> Option<&ExchangeOutcome<P>> {
        self.outcome.as_ref()
    }

    /// Takes that out.
    pub fn take_outcome(&mut self) -> Option<ExchangeOutcome<P>> {
        self.outcome.take()
    }

    fn ended(
        &mut self,
        result: Result<P::Answer, Fault<P::DecodeError>>,
        at: Instant,
    ) -> Option<&ExchangeOutcome<P>> {
        Some(self.outcome.insert(ExchangeOutcome { result, at }))
    }

    fn failed(&mut self, fault: Fault<P::DecodeError>, at: Instant) -> Option<&ExchangeOutcome<P>> {
        self.ended(Err(fault), at)
    }

    /// As [`Master::observe`], of [`Event::Released`].
    pub fn released(&mut self, at: Instant) {
        if self.engine.is_sending() {
            // What was heard before is no part of the answer.
            let rest = self.finish();
            P::forget(&mut self.decoder);
            self.engine.released(rest, at);
        }
    }

    /// As [`Master::observe`], of [`Event::Forced`].
    pub fn forced(&mut self, at: Instant) -> Option<&ExchangeOutcome<P>> {
        if self.engine.forced(at) { self.failed(Fault::NotSent, at) } else { None }
    }

    /// As [`Master::observe`], of [`Event::GivenUp`].
    pub fn given_up(&mut self, at: Instant) -> Option<&ExchangeOutcome<P>> {
        if self.engine.given_up(at) { self.failed(Fault::LineBusy, at) } else { None }
    }

    /// As [`Master::observe`], of [`Event::Heard`].
    pub fn heard(&mut self, character: Character, at: Instant) -> Option<&ExchangeOutcome<P>> {
        if !self.engine.heard(character, at) {
            return None;
        }
        match P::push(&mut self.decoder, character) {
            // The usual course of things: what is handed on is large.
            DecodeProgress::More => None,
            progress => self.progressed(progress, at),
        }
    }

    /// What a decoder's progress means in the state at hand.
    fn progressed(
        &mut self,
        progress: DecodeProgress<P::Answer, P::DecodeError>,
        at: Instant,
    ) -> Option<&ExchangeOutcome<P>> {
        match progress {
            DecodeProgress::More => None,
            DecodeProgress::Bad(error) => {
                let refused = self.engine.refused(error.failed_check(), P::refused_header(&error), at);
                if matches!(refused, Refused::Unused) {
                    return None;
                }
                let outcome = self.failed(Fault::Bad(error), at);
                outcome.filter(|_| matches!(refused, Refused::Reported))
            }
            DecodeProgress::Frame(answer) => {
                let alone = P::discarded(&self.decoder) == 0 && self.outcome.is_none();
                match self.engine.framed(P::header(&answer), alone, at) {
                    Framed::Unused => return None,
                    Framed::Reported => {}
                    Framed::Answer => {
                        let rest = self.finish();
                        self.engine.discard(rest);
                    }
                }
                self.ended(Ok(answer), at)
            }
        }
    }

    /// Lets time pass. To be called again while it returns an outcome.
    pub fn poll(&mut self, now: Instant) -> Option<ExchangeOutcome<P>> {
        self.lapse(now)?;
        self.take_outcome()
    }

    /// As [`Master::poll`], and as [`Master::observe`].
    pub fn lapse(&mut self, now: Instant) -> Option<&ExchangeOutcome<P>> {
        match self.engine.poll(now) {
            Due::Nothing => None,
            Due::NotSent => self.failed(Fault::NotSent, now),
            Due::Answer => self.miss(now),
            Due::Clear => {
                let rest = self.finish();
                self.engine.leave_quiet(rest, now);
                None
            }
        }
    }

    /// The deadline has passed.
    #[cold]
    #[inline(never)]
    fn miss(&mut self, now: Instant) -> Option<&ExchangeOutcome<P>> {
        // What the decoder has held back until now; each report takes at least a character, so this ends.
        while self.engine.is_waiting() {
            let progress = P::idle(&mut self.decoder);
            if matches!(progress, DecodeProgress::More) {
                let bad = match &self.outcome {
                    Some(ExchangeOutcome { result: Err(Fault::Bad(error)), .. }) => {
                        Some(error.failed_check())
                    }
                    _ => None,
                };
                let (missed, at) = self.engine.missed(bad, P::discarded(&self.decoder), now)?;
                let fault = match missed {
                    // Its error is here.
                    Missed::Refused => {
                        return self.outcome.as_mut().map(|outcome| {
                            outcome.at = at;
                            &*outcome
                        });
                    }
                    Missed::Garbled { characters } => Fault::Garbled { characters },
                    Missed::NoAnswer { waited } => Fault::NoAnswer { waited },
                    Missed::Contention => Fault::Contention,
                    Missed::Over { answers, garbled } => Fault::Over { answers, garbled },
                };
                return self.failed(fault, at);
            }
            if self.progressed(progress, self.engine.last_heard()).is_some() {
                return self.outcome();
            }
        }
        None
    }

    /// No more characters come: lets the decoder decide about those it holds.
    fn finish(&mut self) -> Rest {
        let mut rest = Rest::default();
        // Each report takes at least one character out of the decoder, so this ends.
        loop {
            match P::idle(&mut self.decoder) {
                DecodeProgress::More => break,
                DecodeProgress::Bad(_) => {}
                DecodeProgress::Frame(_) => rest.frames = rest.frames.saturating_add(1),
            }
        }
        rest.discarded = P::discarded(&self.decoder);
        rest
    }

    /// When [`Master::poll`] has something to do, if ever.
    pub fn poll_at(&self) -> Option<Instant> {
        self.engine.poll_at()
    }
}

#[cfg(test)]
mod tests;
