//! The server: listens, answers, listens again.
//!
//! ```text
//!              a whole frame for us, t3.5 of silence         transmission complete
//!  Listening ─────────────────────────────────────▶ Sending ─────────────────────▶ Listening
//!      │ ▲                                           ▲ │
//!      │ └───────────────────────────────────────────┼─┘ the port has not said so in twice the frame's time
//!      └──────────────────▶ Prepared ────────────────┘
//!         a request to read:         t3.5 of silence; a character before that leads back to Listening, a zero does not
//!         no more of it comes in t1.5
//! ```
//!
//! Reading takes time, most of all when values change meanwhile, and changes nothing: so the answer is made when nothing
//! more of the request has come in t1.5 and a character after its end, and goes out when t3.5 is over. Everything else is
//! carried out only then.

use clino_bus::{Duration, Instant};
use clino_codec::character::Character;

use crate::diagnostics::{Counters, bump};
use crate::exception::Exception;
use crate::frame::Frame;
use crate::functions::{self, Inner};
use crate::host::Host;
use crate::identification::Identification;
use crate::own::Own;
use crate::receiver::{CHECKSUM, Ended, Receiver};
use crate::repeat::{ECHO_WINDOW, Repeats};
use crate::request::{self, Form, function};
use crate::settings::Settings;

/// Address of broadcasts.
const BROADCAST: u8 = 0;

/// After this many times the duration of an answer, the port has failed to send it.
const SENDING_TIMES: u32 = 2;
/// Added to that: the port may pause before the answer.
const SENDING_MORE: Duration = Duration::from_millis(10);

/// A Modbus RTU server. See the crate documentation.
#[derive(Debug)]
pub struct Server {
    receiver: Receiver,
    state: State,
    own: Own,
    repeats: Repeats,
    changed: bool,
    inner: Inner,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Listening,
    /// The answer is in the frame; t3.5 is not over.
    Prepared {
        /// It is an exception.
        refused: bool,
    },
    Sending {
        give_up: Instant,
    },
}

impl Server {
    /// A server whose port listens since `now`.
    pub const fn new(settings: Settings, identification: &'static Identification, now: Instant) -> Server {
        let counters =
            Counters { messages: 0, errors: 0, exceptions: 0, requests: 0, unanswered: 0, overruns: 0 };
        Server {
            receiver: Receiver::new(&settings, now),
            state: State::Listening,
            own: Own::new(settings.echo),
            repeats: Repeats::new(),
            changed: false,
            inner: Inner { settings, identification, counters, next: None },
        }
    }

    /// Takes a character; `at` is the centre of its stop bit. While an answer goes out, characters are its echo at best.
    pub fn heard(&mut self, character: Character, at: Instant) {
        if self.own.is_deaf(at) {
            self.repeats.doubt();
        }
        // The answer stays in the frame until something else is heard.
        if self.own.is_own(character, at, self.receiver.frame.bytes(), &self.inner.settings) {
            return;
        }
        let prepared = self.state != State::Listening && self.receiver.goes_on(at);
        let appended = self.receiver.is_appended(character);
        let lost = self.receiver.heard(character, at);
        if prepared && appended && self.receiver.is_whole() {
            // A zero behind a request to read: its answer stays, until t3.5 after that.
            return;
        }
        self.state = State::Listening;
        if prepared {
            // The request was none, and its answer stands in its place.
            self.receiver.spoil();
        }
        match lost {
            Ended::Silence => {}
            Ended::Whole => bump(&mut self.inner.counters.unanswered),
            Ended::Spoilt { overrun } => self.count_spoilt(overrun),
        }
    }

    /// Lets time pass: the answer to be sent now, if there is one. It stays where it is until [`Server::sent`].
    ///
    /// All that was heard until `now` has to be handed over before.
    pub fn poll<H: Host>(&mut self, now: Instant, host: &mut H) -> Option<&[u8]> {
        if self.poll_at().is_none_or(|at| now < at) {
            return None;
        }
        match self.state {
            State::Sending { .. } => {
                self.own.forget();
                self.listen(now);
                return None;
            }
            State::Listening if self.receiver.ends_at().is_some_and(|at| now < at) => {
                self.prepare(host);
                return None;
            }
            State::Listening => {
                if !self.serve(now, host) {
                    self.run_as_asked(now);
                    return None;
                }
            }
            State::Prepared { refused } => self.count_prepared(refused),
        }
        let bytes = self.receiver.frame.bytes();
        let time = self.inner.settings.characters(bytes.len() as u32);
        self.repeats.sent(bytes, now + time.times(2) + ECHO_WINDOW);
        self.own.begin();
        self.state = State::Sending { give_up: now + time.times(SENDING_TIMES) + SENDING_MORE };
        Some(bytes)
    }

    /// When [`Server::poll`] has something to do, if ever.
    pub fn poll_at(&self) -> Option<Instant> {
        match self.state {
            State::Listening if self.is_to_read() => self.receiver.closes_at(),
            State::Listening | State::Prepared { .. } => self.receiver.ends_at(),
            State::Sending { give_up } => Some(give_up),
        }
    }

    /// The last stop bit of the answer was out at `at`, or the port has given it up.
    pub fn sent(&mut self, at: Instant) {
        if matches!(self.state, State::Sending { .. }) {
            self.own.out(at, &self.inner.settings);
            self.listen(at);
        }
    }

    /// How the port is to run from now on, if that has changed since this was last asked. To be asked after every
    /// [`Server::poll`] and [`Server::sent`].
    pub fn reconfigured(&mut self) -> Option<Settings> {
        core::mem::take(&mut self.changed).then_some(self.inner.settings)
    }

    /// Runs the port like this from `now` on. A request in hand is lost.
    pub fn set(&mut self, settings: Settings, now: Instant) {
        if settings.echo != self.inner.settings.echo {
            self.own = Own::new(settings.echo);
        }
        self.own.forget();
        self.inner.settings = settings;
        self.inner.next = None;
        self.changed = true;
        self.state = State::Listening;
        self.receiver.restart(&settings, now);
    }

    /// The settings in force.
    pub fn settings(&self) -> &Settings {
        &self.inner.settings
    }

    /// What happened on the port.
    pub fn counters(&self) -> &Counters {
        &self.inner.counters
    }

    fn listen(&mut self, now: Instant) {
        self.state = State::Listening;
        self.run_as_asked(now);
    }

    fn run_as_asked(&mut self, now: Instant) {
        if let Some(settings) = self.inner.next.take() {
            self.set(settings, now);
        }
    }

    /// Whether the frame asks us for registers and nothing else.
    fn is_to_read(&self) -> bool {
        let address = self.inner.settings.address;
        self.receiver.is_whole()
            && self.receiver.exactly().is_some_and(|request| {
                request::only_reads(&request, address) && !self.repeats.knows(&request)
            })
    }

    /// Makes the answer to a request that only reads, while t3.5 goes on.
    fn prepare<H: Host>(&mut self, host: &mut H) {
        self.receiver.cut(request::READ.saturating_sub(CHECKSUM));
        let refused = self.answer(|inner, frame| functions::execute(inner, frame, false, host));
        self.state = State::Prepared { refused };
    }

    /// The silence is over, and the answer is there.
    fn count_prepared(&mut self, refused: bool) {
        self.receiver.used();
        let counters = &mut self.inner.counters;
        bump(&mut counters.messages);
        bump(&mut counters.requests);
        if refused {
            bump(&mut counters.exceptions);
        }
    }

    fn count_spoilt(&mut self, overrun: bool) {
        self.repeats.doubt();
        let counters = &mut self.inner.counters;
        bump(&mut counters.errors);
        if overrun {
            bump(&mut counters.overruns);
        }
    }

    /// The silence is over. Says whether there is an answer in the frame.
    fn serve<H: Host>(&mut self, now: Instant, host: &mut H) -> bool {
        let counters = &mut self.inner.counters;
        match self.receiver.end() {
            Ended::Silence => return false,
            Ended::Spoilt { overrun } => {
                self.count_spoilt(overrun);
                return false;
            }
            Ended::Whole => bump(&mut counters.messages),
        }
        let frame = self.receiver.frame.bytes();
        let &[address, ..] = frame else { return false };
        let broadcast = address == BROADCAST;
        if !broadcast && address != self.inner.settings.address {
            return false;
        }
        bump(&mut counters.requests);
        let form = request::form(frame);
        if form == Form::Answer {
            self.repeats.doubt();
        }
        let (Form::Request(length), false) = (form, self.repeats.is_echo(frame, now)) else {
            bump(&mut counters.unanswered);
            return false;
        };
        let busy = !broadcast && request::is_its_answer(frame) && self.repeats.is_full(frame, now);
        self.receiver.cut(length.saturating_sub(CHECKSUM));
        let refused = self.answer(|inner, frame| match busy {
            true => Err(Exception::ServerDeviceBusy),
            false => functions::execute(inner, frame, broadcast, host),
        });
        if refused {
            bump(&mut self.inner.counters.exceptions);
        }
        if broadcast {
            bump(&mut self.inner.counters.unanswered);
        }
        !broadcast
    }

    /// Puts the result of the request in its place, as an answer; returns whether that is an exception.
    fn answer(&mut self, make: impl FnOnce(&mut Inner, &mut Frame) -> Result<(), Exception>) -> bool {
        let frame = &mut self.receiver.frame;
        let &[address, function, ..] = frame.bytes() else { return false };
        let result = make(&mut self.inner, frame);
        if let Err(exception) = result {
            refuse(frame, address, function, exception);
        }
        frame.seal();
        result.is_err()
    }
}

fn refuse(frame: &mut Frame, address: u8, code: u8, exception: Exception) {
    frame.truncate(0);
    frame.extend(&[address, code | function::EXCEPTION, exception as u8]);
}
