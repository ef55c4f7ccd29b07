//! From characters to frames: silences of t3.5 are between them.
//!
//! ```text
//!   last stop bit                                    t3.5
//!   ┤─────────── a character that begins here ────────┼── one that begins here ──▶
//!               belongs to the frame                      begins the next frame
//! ```
//!
//! | the frame so far | ends |
//! |---|---|
//! | its checksum is right, or it is no frame whatever follows | at t3.5 |
//! | its checksum is not right yet | a character later: one that began before t3.5 shows only when it is whole |
//!
//! [`Pauses::Strict`] drops a frame with a pause of more than t1.5 in it, as the specification asks for; USB adapters make
//! longer ones, which [`Pauses::Tolerant`] accepts.
//!
//! **Zeros behind a right checksum** leave it right: its register is zero, and stays so. They are counted and held
//! back until a character that is not zero shows that they belong to the frame, or its end. What they mean depends on how
//! long a request of this function is, see `request.rs`. A framing or parity error of such a zero comes from a driver that
//! is switched off, and spoils nothing unless the frame goes on. Zeros *before* a frame do change its checksum: it
//! begins with 0xFFFF.
//!
//! The checksum is made as the characters come, so that little is left to do when the silence is over.
//!
//! Source: MODBUS over Serial Line V1.02, section 2.5.1.1. A silence is taken from the end of a stop bit to the beginning
//! of the next start bit.

use clino_bus::{Duration, Instant};
use clino_codec::character::{Character, LineErrors};

use crate::crc;
use crate::frame::{Frame, MAX_FRAME};
use crate::settings::{Pauses, Settings};

/// Puts characters together to frames.
#[derive(Debug)]
pub struct Receiver {
    pub frame: Frame,
    /// Zeros behind it that its checksum is blind to.
    zeros: usize,
    /// Errors that the receiver reported for them.
    zeros_errors: LineErrors,
    waits: Waits,
    crc: u16,
    /// Centre of the last stop bit, while its silence of t3.5 is awaited.
    last: Option<Instant>,
    errors: LineErrors,
    /// A pause in it, or too many characters: no frame.
    broken: bool,
}

/// Times that follow from the settings, computed once.
#[derive(Clone, Copy, Debug)]
struct Waits {
    /// A character.
    character: Duration,
    /// The longest pause that a frame may have.
    pause: Duration,
    /// From the centre of a stop bit until a character that began within t1.5 is whole.
    closed: Duration,
    /// The silence that ends a frame.
    silence: Duration,
    /// The same from the centre of a stop bit.
    end: Duration,
    /// From there until a character that began within t3.5 is whole.
    end_open: Duration,
}

/// The characters between two silences.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// Nothing.
    Silence,
    /// A frame without a fault.
    Whole,
    /// Something else.
    Spoilt {
        /// Characters were lost because they were not fetched in time.
        overrun: bool,
    },
}

/// Shortest frame: address, function, checksum.
const MIN_FRAME: usize = 2 + CHECKSUM;
/// Bytes of the checksum.
pub const CHECKSUM: usize = 2;

/// How much later than it should a character may be stamped: interrupts of the same rank come first at times; µs.
const STAMP_DELAY: u32 = 50;

impl Receiver {
    /// A receiver that was switched on at `now`: what it hears in the next t3.5 may be the rest of something.
    pub const fn new(settings: &Settings, now: Instant) -> Receiver {
        Receiver {
            frame: Frame::new(),
            zeros: 0,
            zeros_errors: LineErrors::NONE,
            waits: Waits::new(settings),
            crc: crc::EMPTY,
            last: Some(now),
            errors: LineErrors::NONE,
            broken: false,
        }
    }

    /// The same for a receiver that was switched to other settings.
    pub fn restart(&mut self, settings: &Settings, now: Instant) {
        self.waits = Waits::new(settings);
        self.begin();
        self.last = Some(now);
    }

    /// Takes a character; `at` is the centre of its stop bit. Returns what was before it if that was over and is lost,
    /// because the server has not fetched it.
    pub fn heard(&mut self, character: Character, at: Instant) -> Ended {
        let mut lost = Ended::Silence;
        match self.silence(at) {
            Some(silence) if silence < self.waits.silence => {
                self.broken |= silence > self.waits.pause || self.length() == 0;
            }
            waited => {
                if waited.is_some() {
                    lost = self.end();
                }
                self.begin();
            }
        }
        self.last = Some(at);
        if self.is_appended(character) {
            self.zeros = self.zeros.saturating_add(1);
            self.zeros_errors |= character.errors;
            return lost;
        }
        self.take_zeros();
        self.errors |= character.errors;
        self.crc = crc::with(self.crc, character.byte);
        self.broken |= !self.frame.byte(character.byte);
        lost
    }

    /// Whether a character is a zero behind a right checksum.
    pub fn is_appended(&self, character: Character) -> bool {
        character.byte == 0 && !character.errors.contains(LineErrors::OVERRUN) && self.is_whole()
    }

    /// Whether a character that is whole at `at` began within t3.5 of the last one.
    pub fn goes_on(&self, at: Instant) -> bool {
        self.silence(at).is_some_and(|silence| silence < self.waits.silence)
    }

    /// From then on, a character that is whole began later than t1.5 after the last one. The frame may be used, but not
    /// answered: one that is whole before t3.5 is over spoils it.
    pub fn closes_at(&self) -> Option<Instant> {
        self.last.map(|last| last + self.waits.closed)
    }

    /// Whether what was received is a frame without a fault, unless more follows.
    pub fn is_whole(&self) -> bool {
        !self.is_spoilt() && self.frame.bytes().len() >= MIN_FRAME && self.crc == crc::RESIDUE
    }

    /// What was received, if that is `N` bytes; with the zeros that were held back.
    pub fn exactly<const N: usize>(&self) -> Option<[u8; N]> {
        let mut bytes = [0; N];
        bytes.iter_mut().zip(self.frame.bytes()).for_each(|(place, &byte)| *place = byte);
        (self.length() == N).then_some(bytes)
    }

    /// Characters so far.
    pub fn length(&self) -> usize {
        self.frame.bytes().len().saturating_add(self.zeros)
    }

    /// The characters so far are no frame, whatever follows.
    pub fn spoil(&mut self) {
        self.broken = true;
    }

    /// The silence is over, and the frame was used.
    pub fn used(&mut self) {
        self.last = None;
    }

    /// When the frame is over, if there is one.
    pub fn ends_at(&self) -> Option<Instant> {
        let open = !self.is_spoilt() && !self.is_whole() && self.length() != 0;
        self.last.map(|last| last + if open { self.waits.end_open } else { self.waits.end })
    }

    /// The silence is over.
    pub fn end(&mut self) -> Ended {
        self.last = None;
        if self.length() == 0 {
            return Ended::Silence;
        }
        if !self.is_whole() {
            return Ended::Spoilt { overrun: self.errors.contains(LineErrors::OVERRUN) };
        }
        self.take_zeros();
        Ended::Whole
    }

    /// Cuts the frame to `length` bytes, those that were held back included.
    pub fn cut(&mut self, length: usize) {
        for _ in self.frame.bytes().len()..length.min(MAX_FRAME) {
            self.frame.byte(0);
        }
        self.frame.truncate(length);
    }

    /// Puts the zeros that were held back into the frame.
    fn take_zeros(&mut self) {
        let length = self.length();
        self.broken |= length > MAX_FRAME;
        self.cut(length);
        self.zeros = 0;
        self.errors |= core::mem::replace(&mut self.zeros_errors, LineErrors::NONE);
    }

    /// From the last character to the beginning of one that is whole at `at`.
    fn silence(&self, at: Instant) -> Option<Duration> {
        // From stop bit to stop bit there is a character in between.
        self.last.map(|last| at.since(last) - self.waits.character)
    }

    /// Whether it is no frame, whatever follows. Noise alone does not spoil a character: its samples disagreed, the
    /// majority is what the checksum is about.
    fn is_spoilt(&self) -> bool {
        let misread = [LineErrors::FRAMING, LineErrors::PARITY, LineErrors::OVERRUN];
        self.broken || misread.into_iter().any(|error| self.errors.contains(error))
    }

    fn begin(&mut self) {
        self.frame.truncate(0);
        self.zeros = 0;
        self.zeros_errors = LineErrors::NONE;
        self.crc = crc::EMPTY;
        self.errors = LineErrors::NONE;
        self.broken = false;
    }
}

impl Waits {
    const fn new(settings: &Settings) -> Waits {
        let (bit, silence, character) =
            (settings.bits(1).as_micros(), settings.t3_5(), settings.characters(1));
        // One bit for two clocks that are not the same.
        let t1_5 = settings.t1_5().as_micros().saturating_add(bit).saturating_add(STAMP_DELAY);
        let pause = match settings.pauses {
            Pauses::Tolerant => silence,
            Pauses::Strict => Duration::from_micros(t1_5),
        };
        // The centre of a stop bit is half a bit before its end.
        let end = bit.div_ceil(2).saturating_add(silence.as_micros());
        Waits {
            character,
            pause,
            // Later than the latest that counts.
            closed: Duration::from_micros(t1_5.saturating_add(character.as_micros()).saturating_add(1)),
            silence,
            end: Duration::from_micros(end),
            end_open: Duration::from_micros(
                end.saturating_add(character.as_micros()).saturating_add(STAMP_DELAY),
            ),
        }
    }
}
