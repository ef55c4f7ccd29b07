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
    crc: u16,
    /// Centre of the last stop bit, while its silence of t3.5 is awaited.
    last: Option<Micros>,
    errors: LineErrors,
    /// A pause in it, or too many characters: no frame.
    broken: bool,
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
const MIN_FRAME: usize = 4;

/// How much later than it should a character may be stamped: interrupts of the same rank come first at times.
const STAMP_DELAY: Micros = Micros(50);

impl Receiver {
    /// A receiver that was switched on at `now`: what it hears in the next t3.5 may be the rest of something.
    pub const fn new(now: Micros) -> Receiver {
        Receiver {
            frame: Frame::new(),
            crc: crc::EMPTY,
            last: Some(now),
            errors: LineErrors::NONE,
            broken: false,
        }
    }

    /// Takes a character; `at` is the centre of its stop bit. Says whether a frame before it was over and is lost,
    /// because nobody has fetched it.
    pub fn heard(&mut self, character: Character, at: Micros, settings: &Settings) -> bool {
        // From stop bit to stop bit there is a character in between.
        let silence = self.last.map(|last| at.since(last).since(settings.characters(1)));
        let mut lost = false;
        match silence {
            Some(silence) if silence < settings.t3_5() => {
                // One bit for two clocks that are not the same.
                let longest = settings.t1_5() + settings.bits(1) + STAMP_DELAY;
                self.broken |= silence > longest || self.frame.bytes().is_empty();
            }
            _ => {
                lost = silence.is_some() && !self.frame.bytes().is_empty();
                self.begin();
            }
        }
        self.last = Some(at);
        self.errors |= character.errors;
        self.crc = crc::with(self.crc, character.byte);
        self.broken |= !self.frame.byte(character.byte);
        lost
    }

    /// When t3.5 is over after the last character, if there was one.
    pub fn ends_at(&self, settings: &Settings) -> Option<Micros> {
        // The centre of a stop bit is half a bit before its end.
        self.last.map(|last| last + Micros(settings.bits(1).0.div_ceil(2)) + settings.t3_5())
    }

    /// The silence is over.
    pub fn end(&mut self) -> Ended {
        self.last = None;
        let length = self.frame.bytes().len();
        if length == 0 {
            return Ended::Silence;
        }
        if self.broken || self.is_misread() || length < MIN_FRAME || self.crc != crc::RESIDUE {
            return Ended::Spoilt { overrun: self.errors.contains(LineErrors::OVERRUN) };
        }
        self.frame.truncate(length.saturating_sub(2));
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
