//! The phases of one exchange. The caller has the port: [`step`](Exchange::step) says what to do, the other methods
//! take the result.

use core::ops::ControlFlow;

use clino_bus::{Duration, ExchangeKind, ExchangeOutcome, Fault, Instant, Prepared};
use clino_codec::character::Character;

use super::clock::{Came, Clock};
use super::witness::suspect;
use super::{Exchanges, Failure, Sensor};
use crate::Suspect;

/// More unsolicited characters than this are not left over in a receive buffer, but come from a node that does
/// not stop transmitting. Our choice: larger than the usual buffers.
const MOST_STALE: u32 = 1_024;

/// What the port has to do next.
#[derive(Clone, Copy)]
pub enum Step {
    /// Hand over what is heard, and say when the span has passed.
    Listen(Duration),
    /// Send the [frame](Exchange::frame), and say whether it got out whole.
    Send,
    /// Nothing: an outcome is here, see [`Exchange::take`]. One of several, if the exchange collects them.
    Partly,
    /// Nothing more: the last outcome is here.
    Over,
}

/// One exchange.
pub struct Exchange<'a, S: Sensor> {
    all: &'a mut Exchanges<S>,
    request: &'a Prepared<S>,
    /// Tries that failed.
    tried: u8,
    /// The next one not before this.
    next: Instant,
    /// Any number of sensors may answer until so long after the request.
    window: Option<Duration>,
    phase: Phase,
    /// Guarding: the request has to be sent by then.
    give_up: Instant,
    /// Guarding: characters heard.
    stale: u32,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// What was before still has its effects. What is heard may be a late answer.
    Settling,
    /// The line has to be silent for a span. What is heard is left over from before.
    Guarding,
    /// It was not, in the present span.
    Disturbed,
    /// It was.
    Silent,
    /// The frame is on its way, or the answer.
    Waiting,
    /// One of several outcomes is here; the master keeps it.
    Partly,
    /// The last one is.
    Over,
}

// What the loop around an exchange calls stays in functions of its own: inlined, it takes 0.8 KB more for each protocol.
impl<'a, S: Sensor> Exchange<'a, S> {
    pub fn new(all: &'a mut Exchanges<S>, request: &'a Prepared<S>) -> Self {
        // For so long, a sensor may take what we send for the end of a frame that was cut.
        let next = if all.clock.half_sent { all.clock.now + S::COMMAND_TIMEOUT } else { Instant::ZERO };
        let phase = Phase::Settling;
        Self { all, request, tried: 0, next, window: None, phase, give_up: next, stale: 0 }
    }

    /// What is to be sent.
    pub fn frame(&self) -> &'a [u8] {
        self.request.frame()
    }

    /// The same, after this many tries that failed.
    #[cfg(feature = "commissioning")]
    pub fn after(self, tried: u8) -> Self {
        Self { tried, ..self }
    }

    /// The same, for any number of answers.
    #[cfg(feature = "commissioning")]
    pub fn collecting(self, window: Duration) -> Self {
        Self { window: Some(window), ..self }
    }

    /// What to do next.
    #[inline(never)]
    pub fn step(&mut self) -> Step {
        if let Some(next) = self.again_at() {
            (self.tried, self.next) = (self.tried.saturating_add(1), next);
            self.phase = Phase::Settling;
        }
        if self.phase == Phase::Settling {
            if let Some(at) = self.settled_at().filter(|&at| at > self.all.clock.now) {
                return self.listen_until(at);
            }
            self.all.clock.half_sent = false;
            self.give_up = self.all.clock.now + self.all.master.timing().line_busy;
            (self.phase, self.stale) = (Phase::Guarding, 0);
        }
        match self.phase {
            Phase::Silent => {
                self.begin();
                self.phase = Phase::Waiting;
                // Until the port says otherwise, the frame may have been cut: a future can be dropped.
                self.all.clock.half_sent = true;
                Step::Send
            }
            Phase::Over => Step::Over,
            Phase::Partly => {
                self.phase = Phase::Waiting;
                Step::Partly
            }
            Phase::Waiting => match self.all.master.poll_at() {
                Some(deadline) => self.listen_until(deadline),
                // Nothing is in hand, and so nothing comes.
                None => Step::Over,
            },
            Phase::Settling | Phase::Guarding | Phase::Disturbed => {
                Step::Listen(self.all.master.timing().guard)
            }
        }
    }

    /// The outcome that is here.
    pub fn take(&mut self) -> ExchangeOutcome<S> {
        let nothing = ExchangeOutcome { result: Err(Fault::NotSent), at: self.all.clock.now };
        self.all.master.take_outcome().unwrap_or(nothing)
    }

    /// From when on the request may be sent.
    fn settled_at(&self) -> Option<Instant> {
        let engine = self.all.master.engine();
        // An exchange that was dropped is still in hand: it has a deadline.
        let clear = engine.ask_at(&self.request.reply()).or_else(|| engine.poll_at());
        clear.map(|clear| clear.max(self.next))
    }

    /// Only operations ask several sensors at once.
    fn window(&self) -> Option<Duration> {
        self.window.filter(|_| cfg!(feature = "commissioning"))
    }

    fn listen_until(&self, at: Instant) -> Step {
        Step::Listen(self.all.clock.until(at))
    }

    /// A character came `after` the beginning of the span. Breaks when the rest of the span is of no interest.
    #[inline(never)]
    pub fn heard(&mut self, character: Character, after: Duration) -> ControlFlow<()> {
        let all = &mut *self.all;
        let one = all.master.engine().character();
        let Came { at, proven } = all.clock.hear(character, after, one, S::PRINTS_LINES);
        let ended = all.master.heard(character, at).is_some() || all.master.lapse(proven).is_some();
        let enough = match self.phase {
            Phase::Settling => self.settled_at().is_none_or(|at| at <= proven),
            Phase::Guarding | Phase::Disturbed | Phase::Silent => {
                self.phase = Phase::Disturbed;
                self.stale = self.stale.wrapping_add(1);
                self.stale > MOST_STALE
            }
            Phase::Waiting => {
                if ended {
                    self.ended();
                }
                ended
            }
            Phase::Partly | Phase::Over => true,
        };
        if !enough {
            return ControlFlow::Continue(());
        }
        self.all.clock.now = self.all.clock.now.max(proven);
        if self.phase == Phase::Disturbed {
            self.give_up();
        }
        ControlFlow::Break(())
    }

    /// The span has passed.
    #[inline(never)]
    pub fn passed(&mut self, span: Duration) {
        let all = &mut *self.all;
        all.clock.now = all.clock.now + span;
        let ended = all.master.lapse(all.clock.now).is_some();
        match self.phase {
            Phase::Guarding => self.phase = Phase::Silent,
            Phase::Disturbed if all.clock.now >= self.give_up => self.give_up(),
            Phase::Disturbed => self.phase = Phase::Guarding,
            Phase::Waiting if ended => self.ended(),
            _ => {}
        }
    }

    /// The master has an outcome. One that collects has several, of which the last says so.
    fn ended(&mut self) {
        let last = self.window().is_none() || !self.all.master.is_asking();
        self.phase = if last { Phase::Over } else { Phase::Partly };
    }

    /// The frame is out, or did not get out whole.
    #[inline(never)]
    pub fn sent(&mut self, whole: bool) {
        let all = &mut *self.all;
        all.clock.sent(whole);
        let at = all.clock.now;
        if whole {
            all.master.released(at);
        } else if all.master.forced(at).is_some() {
            self.phase = Phase::Over;
        }
    }

    /// Why there is no answer, and what to suspect.
    pub fn failure<E>(&self, fault: Fault<S::DecodeError>) -> Failure<S, E> {
        let Exchanges { master, clock, .. } = &*self.all;
        let Clock { released, now, witness, history, .. } = clock;
        let suspect = suspect::<S>(&fault, self.frame(), witness, history, master.counters());
        let fault = match suspect {
            // Whatever the decoder made of our own characters: the sensor said nothing.
            Suspect::OwnEcho => Fault::NoAnswer { waited: now.since(*released) },
            _ => fault,
        };
        Failure::Fault(fault, suspect)
    }

    /// The line does not fall silent: the request ends before it is sent.
    fn give_up(&mut self) {
        self.phase = Phase::Guarding;
        let at = self.all.clock.now;
        self.begin();
        if self.all.master.given_up(at).is_some() {
            self.phase = Phase::Over;
        }
    }

    fn begin(&mut self) {
        let kind = match self.window() {
            Some(window) => ExchangeKind::Collecting(window),
            None if self.tried == 0 => ExchangeKind::First,
            None => ExchangeKind::Retry,
        };
        self.all.master.begin_prepared(self.request, kind, self.all.clock.now);
    }

    /// When to try again after what came out.
    fn again_at(&self) -> Option<Instant> {
        let Phase::Over = self.phase else { return None };
        let ExchangeOutcome { result: Err(fault), at } = self.all.master.outcome()? else { return None };
        self.all.retry.after(self.tried.saturating_add(1), self.request.writes(), fault, *at)
    }
}
