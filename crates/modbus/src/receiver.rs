//! From characters to frames: silences of t3.5 are between them, none of more than t1.5 is within.
//!
//! Source: MODBUS over Serial Line V1.02, section 2.5.1.1. A silence is taken from the end of a stop bit to the beginning
//! of the next start bit. The beginning of a character shows only when it is whole: a frame that is followed by 1.5 to
//! 3.5 characters of silence and then by another character is known to be none when that character is whole; if t3.5 is
//! over before that, the frame counts.
//!
//! The checksum is made as the characters come, so that little is left to do when the silence is over.

use clino_bus::Micros;
use clino_codec::character::{Character, LineErrors};

use crate::crc;
use crate::frame::Frame;
use crate::settings::Settings;

/// Puts characters together to frames.
#[derive(Debug)]
pub struct Receiver {
    pub frame: Frame,
    waits: Waits,
    crc: u16,
    /// Centre of the last stop bit, while its silence of t3.5 is awaited.
    last: Option<Micros>,
    errors: LineErrors,
    /// A pause in it, or too many characters: no frame.
    broken: bool,
}

/// What the settings mean for time, computed once.
#[derive(Clone, Copy, Debug)]
struct Waits {
    /// A character.
    character: Micros,
    /// The longest pause that is none.
    pause: Micros,
    /// From the centre of a stop bit until the next character of the same frame must be whole.
    closed: Micros,
    /// The silence that ends a frame.
    silence: Micros,
    /// The same from the centre of a stop bit.
    end: Micros,
}

/// What there was between two silences.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// Nothing.
    Silence,
    /// A frame without a fault.
    Whole,
    /// Something else.
    Spoilt {
        /// Characters were lost because nobody fetched them.
        overrun: bool,
    },
}

/// Shortest frame: address, function, checksum.
const MIN_FRAME: usize = 2 + CHECKSUM;
const CHECKSUM: usize = 2;

/// How much later than it should a character may be stamped: interrupts of the same rank come first at times; µs.
const STAMP_DELAY: u64 = 50;

impl Receiver {
    /// A receiver that was switched on at `now`: what it hears in the next t3.5 may be the rest of something.
    pub const fn new(settings: &Settings, now: Micros) -> Receiver {
        let waits = Waits::new(settings);
        let frame = Frame::new();
        Receiver { frame, waits, crc: crc::EMPTY, last: Some(now), errors: LineErrors::NONE, broken: false }
    }

    /// The same for a receiver that was switched to other settings.
    pub fn restart(&mut self, settings: &Settings, now: Micros) {
        self.waits = Waits::new(settings);
        self.begin();
        self.last = Some(now);
    }

    /// Takes a character; `at` is the centre of its stop bit. Says whether a frame before it was over and is lost,
    /// because nobody has fetched it.
    pub fn heard(&mut self, character: Character, at: Micros) -> bool {
        // From stop bit to stop bit there is a character in between.
        let silence = self.last.map(|last| at.since(last).since(self.waits.character));
        let empty = self.frame.bytes().is_empty();
        let mut lost = false;
        match silence {
            Some(silence) if silence < self.waits.silence => {
                self.broken |= silence > self.waits.pause || empty
            }
            _ => {
                lost = silence.is_some() && !empty;
                self.begin();
            }
        }
        self.last = Some(at);
        self.errors |= character.errors;
        self.crc = crc::with(self.crc, character.byte);
        self.broken |= !self.frame.byte(character.byte);
        lost
    }

    /// From then on no character can belong to the frame any more: the silence before it was longer than t1.5. One that is
    /// whole before t3.5 is over spoils the frame.
    pub fn closes_at(&self) -> Option<Micros> {
        self.last.map(|last| last + self.waits.closed)
    }

    /// Whether what was received is a frame without a fault, unless more follows.
    pub fn is_whole(&self) -> bool {
        !self.broken
            && !self.is_misread()
            && self.frame.bytes().len() >= MIN_FRAME
            && self.crc == crc::RESIDUE
    }

    /// Takes the checksum off the frame.
    pub fn open(&mut self) {
        self.frame.truncate(self.frame.bytes().len().saturating_sub(CHECKSUM));
    }

    /// What there is is no frame, whatever follows.
    pub fn spoil(&mut self) {
        self.broken = true;
    }

    /// The silence is over, and the frame was used.
    pub fn used(&mut self) {
        self.last = None;
    }

    /// When t3.5 is over after the last character, if there was one.
    pub fn ends_at(&self) -> Option<Micros> {
        self.last.map(|last| last + self.waits.end)
    }

    /// The silence is over.
    pub fn end(&mut self) -> Ended {
        self.last = None;
        let length = self.frame.bytes().len();
        if length == 0 {
            return Ended::Silence;
        }
        if !self.is_whole() {
            return Ended::Spoilt { overrun: self.errors.contains(LineErrors::OVERRUN) };
        }
        self.open();
        Ended::Whole
    }

    /// Noise alone does not spoil a character: its samples disagreed, the majority is what the checksum is about.
    fn is_misread(&self) -> bool {
        [LineErrors::FRAMING, LineErrors::PARITY, LineErrors::OVERRUN]
            .into_iter()
            .any(|error| self.errors.contains(error))
    }

    fn begin(&mut self) {
        self.frame.truncate(0);
        self.crc = crc::EMPTY;
        self.errors = LineErrors::NONE;
        self.broken = false;
    }
}

impl Waits {
    const fn new(settings: &Settings) -> Waits {
        let (bit, silence, character) = (settings.bits(1).0, settings.t3_5(), settings.characters(1));
        // One bit for two clocks that are not the same.
        let pause = settings.t1_5().0.saturating_add(bit).saturating_add(STAMP_DELAY);
        Waits {
            character,
            pause: Micros(pause),
            // Later than the latest that counts.
            closed: Micros(pause.saturating_add(character.0).saturating_add(1)),
            silence,
            // The centre of a stop bit is half a bit before its end.
            end: Micros(bit.div_ceil(2).saturating_add(silence.0)),
        }
    }
}
