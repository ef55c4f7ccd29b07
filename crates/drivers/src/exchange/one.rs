//! One exchange: its phases, and what passes through the protocol's types. The caller has the port:
//! [`step`](Exchange::step) says what to do, the other methods take the result.

use core::ops::ControlFlow;

use clino_bus::{Duration, Event, ExchangeOutcome, Fault};
use clino_codec::character::Character;

use super::phases::{Means, Phases, Todo};
use super::witness::suspect;
use super::{Exchanges, Failure, Sensor};
use crate::Suspect;

/// What the port has to do next.
pub enum Step<S: Sensor> {
    /// Hand over what is heard, and say when the span has passed.
    Listen(Duration),
    /// Send, and say whether it got out whole.
    Send(S::Frame),
    /// One of several answers, to an exchange that collects them. It is not over.
    Partly(ExchangeOutcome<S>),
    /// Nothing more.
    Over(ExchangeOutcome<S>),
}

/// One exchange.
pub struct Exchange<'a, S: Sensor> {
    all: &'a mut Exchanges<S>,
    address: S::Address,
    request: &'a S::Request,
    /// Any number of sensors may answer until so long after the request.
    window: Option<Duration>,
    phases: Phases,
    /// Not handed over yet.
    outcome: Option<ExchangeOutcome<S>>,
}

// What the loop around an exchange calls stays in functions of its own: inlined, it takes 0.8 KB more for each protocol.
impl<'a, S: Sensor> Exchange<'a, S> {
    pub fn new(all: &'a mut Exchanges<S>, address: S::Address, request: &'a S::Request) -> Self {
        let phases = Phases::new(S::reply(&S::expected(address, request)), S::writes(request));
        Self { all, address, request, window: None, phases, outcome: None }
    }

    /// The same, after this many tries that failed.
    #[cfg(feature = "commissioning")]
    pub fn after(mut self, tried: u8) -> Self {
        self.phases.tried = tried;
        self
    }

    /// The same, for any number of answers.
    #[cfg(feature = "commissioning")]
    pub fn collecting(self, window: Duration) -> Self {
        Self { window: Some(window), ..self }
    }

    /// What to do next.
    #[inline(never)]
    pub fn step(&mut self) -> Result<Step<S>, S::EncodeError> {
        if let Some(outcome) = self.outcome.take() {
            if !self.phases.hand_over() {
                return Ok(Step::Partly(outcome));
            }
            let fault = outcome.result.as_ref().err().map(Fault::by_check);
            let again = |fault| self.phases.begins_again(&self.all.link, &fault, outcome.at);
            if !fault.is_some_and(again) {
                return Ok(Step::Over(outcome));
            }
        }
        let Exchanges { master, link } = &mut *self.all;
        match self.phases.next(link, master.engine()) {
            Todo::Listen(span) => Ok(Step::Listen(span)),
            Todo::Send => {
                let frame = self.begin()?;
                // Until the port says otherwise, the frame may have been cut: a future can be dropped.
                self.all.link.half_sent = true;
                Ok(Step::Send(frame))
            }
            Todo::Nothing => Ok(Step::Over(ExchangeOutcome { result: Err(Fault::NotSent), at: link.now })),
        }
    }

    /// A character came `after` the beginning of the span. Breaks when the rest of the span is of no interest.
    #[inline(never)]
    pub fn heard(&mut self, character: Character, after: Duration) -> ControlFlow<()> {
        let Exchanges { master, link } = &mut *self.all;
        let (at, proven) = link.hear(character, after, master.timing().serial);
        let outcome = master.on(Event::Heard { character, at }).or_else(|| master.poll(proven));
        let means = self.phases.heard(link, master.engine(), outcome.is_some(), proven);
        self.take(means, outcome);
        if means == Means::Nothing { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    }

    /// The span has passed.
    #[inline(never)]
    pub fn passed(&mut self, span: Duration) {
        let Exchanges { master, link } = &mut *self.all;
        link.now = link.now + span;
        let outcome = master.poll(link.now);
        let means = self.phases.passed(link.now);
        self.take(means, outcome);
    }

    /// The master may have an outcome, and this is what happened to the exchange.
    fn take(&mut self, means: Means, outcome: Option<ExchangeOutcome<S>>) {
        match (means, outcome) {
            (Means::Outcome, Some(outcome)) => self.ended(outcome),
            (Means::GivenUp, _) => self.give_up(),
            _ => {}
        }
    }

    /// The master has an outcome. One that collects has several, of which the last says so.
    fn ended(&mut self, outcome: ExchangeOutcome<S>) {
        let is_last = self.window.is_none()
            || matches!(outcome.result, Err(Fault::Over { .. } | Fault::NotSent | Fault::LineBusy));
        self.phases.ended(is_last);
        self.outcome = Some(outcome);
    }

    /// The frame is out, or did not get out whole.
    #[inline(never)]
    pub fn sent(&mut self, whole: bool) {
        let Exchanges { master, link } = &mut *self.all;
        link.sent(whole);
        let at = link.now;
        let event = if whole { Event::Released { at } } else { Event::Forced { at } };
        if let Some(outcome) = master.on(event) {
            self.ended(outcome);
        }
    }

    /// Why there is no answer, and what to suspect.
    pub fn failure<E>(&self, fault: Fault<S::DecodeError>) -> Failure<S, E> {
        let Exchanges { master, link } = &*self.all;
        let frame = S::encode(self.address, self.request);
        let sent = frame.as_ref().ok().map(AsRef::as_ref);
        let (witness, history) = (&link.witness, &link.history);
        let suspect = suspect(S::PRINTS_LINES, &fault.by_check(), sent, witness, history, master.counters());
        let fault = match suspect {
            // Whatever the decoder made of our own characters: the sensor said nothing.
            Suspect::OwnEcho => Fault::NoAnswer { waited: link.now.since(link.released) },
            _ => fault,
        };
        Failure::Fault(fault, suspect)
    }

    /// The line does not fall silent: the request ends before it is sent.
    fn give_up(&mut self) {
        let at = self.all.link.now;
        if self.begin().is_ok()
            && let Some(outcome) = self.all.master.on(Event::GivenUp { at })
        {
            self.ended(outcome);
        }
    }

    fn begin(&mut self) -> Result<S::Frame, S::EncodeError> {
        let Exchanges { master, link } = &mut *self.all;
        if let Some(window) = self.window {
            return master.begin_collecting(self.address, self.request, window, link.now);
        }
        match self.phases.tried {
            0 => master.begin(self.address, self.request, link.now),
            _ => master.begin_retry(self.address, self.request, link.now),
        }
    }
}
