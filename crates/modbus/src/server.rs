//! The server: listens, answers, listens again.
//!
//! ```text
//!              a whole frame for us, t3.5 of silence         transmission complete
//!  Listening ─────────────────────────────────────▶ Sending ─────────────────────▶ Listening
//!      ▲                                               │
//!      └───────────────────────────────────────────────┘ the port has not said so in twice the frame's time
//! ```

use clino_bus::Micros;
use clino_codec::character::Character;

use crate::diagnostics::{Counters, bump};
use crate::exception::Exception;
use crate::frame::Frame;
use crate::functions;
use crate::host::Host;
use crate::identification::Identification;
use crate::receiver::{Ended, Receiver};
use crate::settings::Settings;

/// Requests to everybody.
const BROADCAST: u8 = 0;
/// Set in the function code of an exception's answer.
const EXCEPTION: u8 = 0x80;

/// Until so many bits after our last stop bit a character is our own, coming back: no master can have sent a whole one.
const ECHO_BITS: u32 = 5;
/// An answer takes its own time; this times that, and the port has forgotten it.
const SENDING_TIMES: u64 = 2;
/// And that: the port may keep a pause before it.
const SENDING_MORE: Micros = Micros::from_millis(10);

/// A Modbus RTU server. See the crate documentation.
#[derive(Debug)]
pub struct Server {
    receiver: Receiver,
    state: State,
    /// What is heard until then is our own.
    deaf_until: Micros,
    changed: bool,
    inner: Inner,
}

/// What the functions need of the server.
#[derive(Debug)]
pub(crate) struct Inner {
    pub settings: Settings,
    pub identification: &'static Identification,
    pub counters: Counters,
    /// The port is to run like this as soon as the answer is out.
    pub next: Option<Settings>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Listening,
    Sending { give_up: Micros },
}

impl Server {
    /// A server whose port listens since `now`.
    pub const fn new(settings: Settings, identification: &'static Identification, now: Micros) -> Server {
        let counters =
            Counters { messages: 0, errors: 0, exceptions: 0, requests: 0, unanswered: 0, overruns: 0 };
        Server {
            receiver: Receiver::new(&settings, now),
            state: State::Listening,
            deaf_until: Micros::ZERO,
            changed: false,
            inner: Inner { settings, identification, counters, next: None },
        }
    }

    /// Takes a character; `at` is the centre of its stop bit. While an answer goes out, nothing is heard.
    pub fn heard(&mut self, character: Character, at: Micros) {
        if self.state != State::Listening || at < self.deaf_until {
            return;
        }
        if self.receiver.heard(character, at) {
            bump(&mut self.inner.counters.unanswered);
        }
    }

    /// Lets time pass: the answer to be sent now, if there is one. It stays where it is until [`Server::sent`].
    ///
    /// All that was heard until `now` has to be handed over before.
    pub fn poll<H: Host>(&mut self, now: Micros, host: &mut H) -> Option<&[u8]> {
        if self.poll_at().is_none_or(|at| now < at) {
            return None;
        }
        if self.state != State::Listening {
            self.listen(now);
            return None;
        }
        if !self.serve(host) {
            self.run_as_asked(now);
            return None;
        }
        let bytes = self.receiver.frame.bytes();
        let time = self.inner.settings.characters(bytes.len() as u32);
        self.state = State::Sending { give_up: now + time.times(SENDING_TIMES) + SENDING_MORE };
        Some(bytes)
    }

    /// When [`Server::poll`] has something to do, if ever.
    pub fn poll_at(&self) -> Option<Micros> {
        match self.state {
            State::Listening => self.receiver.ends_at(),
            State::Sending { give_up } => Some(give_up),
        }
    }

    /// The last stop bit of the answer was out at `at`, or the port has given it up.
    pub fn sent(&mut self, at: Micros) {
        if self.state != State::Listening {
            self.deaf_until = at + self.inner.settings.bits(ECHO_BITS);
            self.listen(at);
        }
    }

    /// How the port is to run from now on, if that has changed since this was last asked. To be asked after every
    /// [`Server::poll`] and [`Server::sent`].
    pub fn reconfigured(&mut self) -> Option<Settings> {
        core::mem::take(&mut self.changed).then_some(self.inner.settings)
    }

    /// Runs the port like this from `now` on. A request in hand is lost.
    pub fn set(&mut self, settings: Settings, now: Micros) {
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

    fn listen(&mut self, now: Micros) {
        self.state = State::Listening;
        self.run_as_asked(now);
    }

    fn run_as_asked(&mut self, now: Micros) {
        if let Some(settings) = self.inner.next.take() {
            self.set(settings, now);
        }
    }

    /// The silence is over. Says whether there is an answer in the frame.
    fn serve<H: Host>(&mut self, host: &mut H) -> bool {
        let counters = &mut self.inner.counters;
        match self.receiver.end() {
            Ended::Silence => return false,
            Ended::Spoilt { overrun } => {
                bump(&mut counters.errors);
                if overrun {
                    bump(&mut counters.overruns);
                }
                return false;
            }
            Ended::Whole => bump(&mut counters.messages),
        }
        let frame = &mut self.receiver.frame;
        let &[address, function, ..] = frame.bytes() else { return false };
        let broadcast = address == BROADCAST;
        if !broadcast && address != self.inner.settings.address {
            return false;
        }
        bump(&mut counters.requests);
        if let Err(exception) = functions::execute(&mut self.inner, frame, broadcast, host) {
            bump(&mut self.inner.counters.exceptions);
            refuse(frame, address, function, exception);
        }
        if broadcast {
            bump(&mut self.inner.counters.unanswered);
        } else {
            frame.seal();
        }
        !broadcast
    }
}

fn refuse(frame: &mut Frame, address: u8, function: u8, exception: Exception) {
    frame.truncate(0);
    frame.extend(&[address, function | EXCEPTION, exception as u8]);
}
