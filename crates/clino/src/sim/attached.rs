//! Simulated sensors on a real port: what is heard there goes to the pair of the simulation, and their answers go out.
//!
//! ```text
//! real pair ── adapter ── port ── this file ── simulated pair ┬─ sensor
//!                                              (adapter.rs)    └─ sensor
//! ```
//! # Time
//!
//! A character is read when it is over, and the simulated pair needs as long again to carry it to the sensors. So the
//! simulation runs ahead of the clock: by the length of what was heard, and by that of the answer, which goes out as one
//! frame. The sensor's own latency remains, one character, and what the port adds.
//!
//! # Bit rate
//!
//! The port has one: that of the first sensor. It follows when that sensor is given another rate. Sensors at another rate hear
//! what they would hear on the real pair: nothing that they understand.
//!
//! # Echo
//!
//! An adapter may return what it sends. That is found out, and not taken for a command.

use std::time::{Duration, Instant};

use clino_sim::node::Ns;

use super::adapter::Adapter;
use super::chatter::Chatter;
use crate::bus::{Clock, Echo, Stop, Whose};
use crate::port::{Port, PortError};

/// The longest wait without a look at whether the user wants to stop.
const LOOK: Duration = Duration::from_millis(50);
/// An answer is over when nothing follows for this many characters.
const END_CHARACTERS: u64 = 2;

/// A simulated pair behind a real port.
pub struct Attached {
    port: Box<dyn Port>,
    adapter: Adapter,
    chatter: Chatter,
    start: Instant,
    clock: Clock,
    /// How far the simulation has come.
    reached: Ns,
    /// By how much it is ahead of the clock.
    ahead: Ns,
    echo: Echo,
    /// When an echo that is not back is lost.
    echo_late: Option<Instant>,
    /// What was found out of the echo.
    has_echo: Option<bool>,
    baud: u32,
}

impl Attached {
    /// The pair behind `adapter`, whose first sensor has that bit rate, at a port that has it, too.
    pub fn new(port: Box<dyn Port>, adapter: Adapter, chatter: Chatter, baud: u32) -> Self {
        Self {
            port,
            adapter,
            chatter,
            start: Instant::now(),
            clock: Clock::start(),
            reached: 0,
            ahead: 0,
            echo: Echo::default(),
            echo_late: None,
            has_echo: None,
            baud,
        }
    }

    /// Serves until `stop`.
    ///
    /// # Errors
    /// The port failed.
    pub fn until(mut self, stop: &Stop) -> Result<(), PortError> {
        let mut heard = Vec::new();
        while !stop.is_asked() {
            let wait = self
                .adapter
                .next_event()
                .map_or(LOOK, |at| Duration::from_nanos(at.saturating_sub(self.now())).min(LOOK));
            self.port.receive(wait, &mut heard)?;
            let mut bytes = Vec::new();
            for character in heard.drain(..) {
                match self.echo.judge(character) {
                    Whose::Held => {}
                    Whose::Ours(..) => self.has_echo = Some(true),
                    // A character without a stop bit is none for a sensor either.
                    Whose::Others(others) => {
                        bytes.extend(
                            others.iter().filter(|other| other.errors.is_none()).map(|other| other.byte),
                        );
                    }
                }
            }
            if self.echo_late.take_if(|late| *late < Instant::now()).is_some() {
                bytes.extend(self.echo.give_up().iter().map(|held| held.byte));
                self.echo = Echo::default();
            }
            self.command(&bytes);
            self.answer()?;
            self.follow_rate()?;
            self.chatter.tell();
        }
        Ok(())
    }

    /// What was heard reaches the sensors at once.
    fn command(&mut self, bytes: &[u8]) {
        if bytes.is_empty() {
            return;
        }
        self.ahead = 0;
        self.reached = self.now();
        self.adapter.send(self.reached, bytes);
        while let Some(at) = self.adapter.next_event().filter(|_| self.adapter.is_sending()) {
            // A collision with an answer is heard by none: the answer has gone out already.
            self.adapter.run(at);
            self.reached = self.reached.max(at);
        }
        self.ahead = self.reached.saturating_sub(self.elapsed());
    }

    /// An answer that begins is carried to its end, and goes out.
    fn answer(&mut self) -> Result<(), PortError> {
        self.reached = self.now();
        let mut frame = self.adapter.run(self.reached);
        if frame.is_empty() {
            return Ok(());
        }
        let mut over = self.reached + END_CHARACTERS * self.adapter.character();
        while let Some(at) = self.adapter.next_event().filter(|at| *at <= over) {
            let more = self.adapter.run(at);
            self.reached = at;
            if !more.is_empty() {
                over = at + END_CHARACTERS * self.adapter.character();
            }
            frame.extend(more);
        }
        // The clock catches up while the answer is on the real pair.
        self.ahead = 0;
        self.port.send(&frame)?;
        let length = Duration::from_nanos(frame.len() as u64 * self.adapter.character());
        std::thread::sleep(length);
        self.port.sent()?;
        self.echo_late = Some(Instant::now() + self.port.latency() + length);
        let now = self.clock.now();
        self.echo = Echo::begin(frame, self.has_echo, now, now);
        Ok(())
    }

    /// The first sensor has another rate than the port: the port takes it, too.
    fn follow_rate(&mut self) -> Result<(), PortError> {
        let Some(baud) = self.adapter.first_baud().filter(|&baud| baud != self.baud) else { return Ok(()) };
        self.baud = baud;
        self.adapter.set_baud(self.reached, baud);
        self.port.set_baud(baud)
    }

    /// Virtual time: it never goes back.
    fn now(&self) -> Ns {
        self.reached.max(self.elapsed() + self.ahead)
    }

    fn elapsed(&self) -> Ns {
        u64::try_from(self.start.elapsed().as_nanos()).unwrap_or(Ns::MAX)
    }
}
