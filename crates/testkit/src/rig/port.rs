//! A UART with a driver-enable pin, in virtual time.
//!
//! Idealised where the board is not: interrupts are served [`INTERRUPT`] after their cause. The line's own times are
//! exact, because the segment samples bits.

use clino_bus::line::{self, LineStep, SubmitError};
use clino_bus::{Duration, Event, Instant, Line, Serial};
use clino_codec::character::{Character, LineErrors};
use clino_segment::log::SharedLog;
use clino_segment::wire::{Format, Received, Sent, Wire as _};
use clino_segment::{Segment, SegmentSettings, Station};
use clino_sim::node::Ns;

/// From a cause to its interrupt, nanoseconds: the order of what the board measures.
pub const INTERRUPT: Ns = 1_000;

const NS_PER_US: u64 = 1_000;
const PS_PER_NS: u64 = 1_000;
const PS_PER_S: u64 = 1_000_000_000_000;
const BITS: u64 = 10;
const PPM: u64 = 1_000_000;

/// The UART of a gateway, a [`Line`] in it, and a segment with sensors on it.
pub struct Port {
    segment: Segment,
    line: Line,
    serial: Serial,
    now: Ns,
    clock: Clock,
    shifter: Shifter,
    /// Level of the DE pin.
    driving: bool,
}

/// The transmitter. Times in picoseconds, so that back-to-back characters do not drift.
#[derive(Clone, Copy)]
enum Shifter {
    Empty,
    /// A character is on its way and ends then; the next one is fetched at that instant.
    Full {
        end: u64,
    },
    /// The last character has ended; its interrupt comes then.
    Complete {
        interrupt: Ns,
    },
}

/// The clock of the port's owner: its microseconds, and its bits.
#[derive(Clone, Copy)]
struct Clock {
    /// How much too fast it is, in parts per million; above −[`PPM`].
    ppm: i64,
}

impl Clock {
    fn rate(self) -> u128 {
        u128::from(PPM.saturating_add_signed(self.ppm))
    }

    /// What it says at a true instant.
    fn at(self, now: Ns) -> Instant {
        Instant::from_micros((u128::from(now) * self.rate() / u128::from(PPM * NS_PER_US)) as u64)
    }

    /// The first true instant at which it says this.
    fn when(self, at: Instant) -> Ns {
        let scaled = u128::from(at.as_micros()) * u128::from(PPM * NS_PER_US);
        u64::try_from(scaled.div_ceil(self.rate())).unwrap_or(Ns::MAX)
    }

    /// Bits at a rate that is made of it.
    fn format(self, serial: Serial) -> Format {
        let bit_ps = u128::from(PS_PER_S / u64::from(serial.baud)) * u128::from(PPM) / self.rate();
        Format { bit_ps: bit_ps as u64, data_bits: 8, stop_halves: 2 }
    }
}

impl Port {
    /// A listening port at time 0, without delays around DE.
    pub fn new(serial: Serial, guard: Duration, settings: SegmentSettings, stations: Vec<Station>) -> Port {
        Port::with_line(line::LineSettings::new(serial, guard), settings, stations)
    }

    /// A listening port at time 0. For an echo on the wire, [`SegmentSettings::echo`] has to be set, too.
    pub fn with_line(line: line::LineSettings, settings: SegmentSettings, stations: Vec<Station>) -> Port {
        let mut segment = Segment::new(settings, stations);
        let clock = Clock { ppm: 0 };
        segment.set_receiver(0, Some(clock.format(line.serial)));
        Port {
            segment,
            line: Line::new(line, Instant::ZERO),
            serial: line.serial,
            now: 0,
            clock,
            shifter: Shifter::Empty,
            driving: false,
        }
    }

    /// From now on the port's own clock is this much too fast, in parts per million: what it calls a microsecond, and its
    /// bits. To be called before anything has happened.
    pub fn set_clock_error(&mut self, ppm: i32) {
        self.clock = Clock { ppm: ppm.into() };
        self.segment.set_receiver(self.now, Some(self.clock.format(self.serial)));
    }

    /// The line under test.
    pub fn line(&self) -> &Line {
        &self.line
    }

    /// Time since power-up, as the port's own clock has it.
    pub fn now(&self) -> Instant {
        self.clock.at(self.now)
    }

    /// What happened on the wire.
    pub fn log(&self) -> SharedLog {
        self.segment.log()
    }

    /// The line's bit rate from now on.
    ///
    /// # Panics
    /// If a frame is in hand.
    pub fn set_serial(&mut self, serial: Serial, guard: Duration) {
        let settings = line::LineSettings { serial, guard, ..*self.line.settings() };
        self.line.set(settings, self.now()).expect("no frame in hand");
        self.serial = serial;
        self.segment.set_receiver(self.now, Some(self.clock.format(serial)));
    }

    /// Takes a frame to be sent as soon as the guard allows.
    pub fn submit(&mut self, frame: &[u8], give_up: Instant) -> Result<(), SubmitError> {
        self.line.submit(frame, give_up)
    }

    /// Runs until something happens on the line, at most until `until`.
    pub fn run(&mut self, until: Instant) -> Option<Event> {
        let until = self.clock.when(until);
        loop {
            if let Some(received) = self.segment.take_received() {
                return Some(self.received(received));
            }
            let step = self.line.poll(self.now());
            self.follow();
            if let Some(step) = step {
                if let Some(event) = self.step(step) {
                    return Some(event);
                }
                continue;
            }
            let line = self.line.poll_at().map(|at| self.clock.when(at));
            let shifter = match self.shifter {
                Shifter::Empty => None,
                Shifter::Full { end } => Some(end.div_ceil(PS_PER_NS)),
                Shifter::Complete { interrupt } => Some(interrupt),
            };
            let next = [self.segment.next_event(), line, shifter].into_iter().flatten().min();
            let Some(next) = next.filter(|&next| next <= until) else {
                self.advance(until);
                return self.segment.take_received().map(|received| self.received(received));
            };
            self.advance(next);
            if shifter.is_some_and(|at| at <= self.now)
                && let Some(event) = self.shift()
            {
                return Some(event);
            }
        }
    }

    fn advance(&mut self, to: Ns) {
        self.now = self.now.max(to);
        self.segment.advance(self.now);
    }

    /// DE does what the line says.
    fn follow(&mut self) {
        if core::mem::replace(&mut self.driving, self.line.driving()) != self.driving {
            self.segment.drive_enable(self.now, self.driving);
        }
    }

    fn step(&mut self, step: LineStep) -> Option<Event> {
        match step {
            LineStep::Begin => {
                self.shifter = Shifter::Full { end: self.now * PS_PER_NS };
                return self.shift();
            }
            LineStep::Force => self.shifter = Shifter::Empty,
            LineStep::GiveUp | LineStep::EchoLost => {}
        }
        step.event(self.now())
    }

    /// The character in the shifter has ended: the next one, or the end of the frame.
    fn shift(&mut self) -> Option<Event> {
        match self.shifter {
            Shifter::Empty => {}
            Shifter::Full { end } => {
                let format = self.clock.format(self.serial);
                match self.line.next_character() {
                    Some(byte) => {
                        let start = end / PS_PER_NS;
                        self.segment.send(Sent { start, word: u16::from(byte), format });
                        self.shifter = Shifter::Full { end: end + BITS * format.bit_ps };
                    }
                    None => {
                        self.shifter = Shifter::Complete { interrupt: end.div_ceil(PS_PER_NS) + INTERRUPT }
                    }
                }
            }
            Shifter::Complete { .. } => {
                self.shifter = Shifter::Empty;
                if self.line.transmission_complete(self.now()) {
                    self.follow();
                    return Some(Event::Released { at: self.now() });
                }
            }
        }
        None
    }

    fn received(&mut self, received: Received) -> Event {
        let flag = |set, flag| if set { flag } else { LineErrors::NONE };
        let errors =
            flag(received.framing_error, LineErrors::FRAMING).union(flag(received.noise, LineErrors::NOISE));
        let at = self.clock.at(received.at);
        let event = self.line.heard(Character { byte: received.word as u8, errors }, at);
        self.follow();
        event
    }
}
