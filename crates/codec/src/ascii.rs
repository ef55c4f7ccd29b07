//! The ISU's ASCII output: one angle per line.
//!
//! Source: AN #201 §4, "ASCII Output Mode".
//!
//! ```text
//! position   0     1 2 3   4   5 6   7   8
//!           sign   X X X   .   X X   CR  LF        X: digit; leading ones may be blanks
//! ```
//!
//! Limits: −180.00°…+180.00°, in hundredths of a degree. There is no checksum: a damaged digit passes as a
//! digit, which is why the serial receiver's error flags matter here most.
//!
//! A module sends a line every 533 ms while its RX line is held low, or one for each high-to-low transition.

use core::fmt;

use crate::DecodeProgress;
use crate::angle::Angle;
use crate::bytes::put;
use crate::character::{Character, LineErrors};

/// Characters in a line.
pub const LINE_LENGTH: usize = 9;
/// Largest magnitude, in hundredths of a degree. The document's examples end at
/// −179.99; half a turn is taken as the limit of either sign.
const MAX_CENTIDEG: i16 = 18_000;

/// An angle as sent: hundredths of a degree, −18 000…18 000.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "i16", into = "i16"))]
pub struct Centidegrees(i16);

impl Centidegrees {
    /// An angle that a line can carry.
    pub const fn new(centideg: i16) -> Option<Self> {
        if centideg >= -MAX_CENTIDEG && centideg <= MAX_CENTIDEG { Some(Self(centideg)) } else { None }
    }

    /// The number.
    pub const fn get(self) -> i16 {
        self.0
    }

    /// The angle.
    pub fn angle(self) -> Angle {
        // 18 000 hundredths are far from the limit.
        Angle::from_centideg(i32::from(self.0)).unwrap_or(Angle::ZERO)
    }

    /// The line as a module sends it.
    ///
    /// ```
    /// use clino_codec::ascii::Centidegrees;
    ///
    /// assert_eq!(&Centidegrees::new(938).unwrap().encode(), b"+  9.38\r\n");
    /// ```
    pub fn encode(self) -> [u8; LINE_LENGTH] {
        let mut line = *b"+  0.00\r\n";
        if self.0 < 0 {
            put(&mut line, 0, b'-');
        }
        let mut digits = self.0.unsigned_abs();
        for position in [6, 5, 3, 2, 1] {
            if digits != 0 {
                put(&mut line, position, b'0'.wrapping_add((digits % 10) as u8));
            }
            digits /= 10;
        }
        line
    }
}

/// Not within ±180.00°.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BeyondHalfTurn(pub i16);

impl TryFrom<i16> for Centidegrees {
    type Error = BeyondHalfTurn;

    fn try_from(centideg: i16) -> Result<Self, BeyondHalfTurn> {
        Self::new(centideg).ok_or(BeyondHalfTurn(centideg))
    }
}

impl From<Centidegrees> for i16 {
    fn from(angle: Centidegrees) -> Self {
        angle.get()
    }
}

/// Why a line was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum LineFault {
    /// The receiver complained about a character of the line.
    LineErrors {
        /// All complaints.
        errors: LineErrors,
    },
    /// A character that cannot stand there.
    Unexpected {
        /// The character.
        byte: u8,
        /// Where it stood, 1–8.
        position: u8,
    },
    /// More than half a turn.
    Value {
        /// Hundredths of a degree.
        centideg: i32,
    },
}

/// Reads lines from a stream of characters, starting anywhere.
///
/// A sign can stand only at the start of a line, so that a damaged line never costs the next one.
///
/// ```
/// use clino_codec::DecodeProgress;
/// use clino_codec::ascii::LineDecoder;
/// use clino_codec::character::Character;
///
/// let mut decoder = LineDecoder::new();
/// let mut angle = None;
/// for &byte in b"9.99\r\n- 32.70\r\n" {
///     if let DecodeProgress::Frame(line) = decoder.push(Character::clean(byte)) {
///         angle = Some(line.angle());
///     }
/// }
/// assert_eq!(angle.unwrap().to_string(), "-32.700");
/// assert_eq!(decoder.discarded(), 6);
/// ```
#[derive(Clone, Debug, Default)]
pub struct LineDecoder {
    /// Characters of the line so far.
    position: u8,
    negative: bool,
    /// A digit was seen: no more blanks.
    in_number: bool,
    /// The digits so far, in hundredths of a degree at the end.
    magnitude: i32,
    errors: LineErrors,
    discarded: u32,
}

impl LineDecoder {
    /// A decoder that has seen nothing.
    pub const fn new() -> Self {
        Self {
            position: 0,
            negative: false,
            in_number: false,
            magnitude: 0,
            errors: LineErrors::NONE,
            discarded: 0,
        }
    }

    /// Characters so far that belonged to no line.
    pub const fn discarded(&self) -> u32 {
        self.discarded
    }

    /// Takes one character.
    pub fn push(&mut self, character: Character) -> DecodeProgress<Centidegrees, LineFault> {
        let byte = character.byte;
        let position = self.position;
        if position == 0 {
            self.start(character);
            return DecodeProgress::More;
        }
        self.errors |= character.errors;
        if !self.take(byte) {
            let fault = self.fault(LineFault::Unexpected { byte, position });
            match byte {
                b'+' | b'-' => self.start(character),
                _ => self.position = 0,
            }
            return DecodeProgress::Bad(fault);
        }
        self.position = position.wrapping_add(1);
        if usize::from(self.position) < LINE_LENGTH {
            return DecodeProgress::More;
        }
        self.position = 0;
        let centideg = if self.negative { self.magnitude.wrapping_neg() } else { self.magnitude };
        match i16::try_from(centideg).ok().and_then(Centidegrees::new) {
            Some(angle) if self.errors.is_none() => DecodeProgress::Frame(angle),
            _ => DecodeProgress::Bad(self.fault(LineFault::Value { centideg })),
        }
    }

    /// Receiver errors explain whatever else is wrong.
    fn fault(&self, otherwise: LineFault) -> LineFault {
        if self.errors.is_none() { otherwise } else { LineFault::LineErrors { errors: self.errors } }
    }

    /// Takes the first character of a line, or drops what cannot be one.
    #[inline(never)]
    fn start(&mut self, character: Character) {
        let Self { discarded, .. } = *self;
        *self = Self { discarded, errors: character.errors, ..Self::new() };
        match character.byte {
            sign @ (b'+' | b'-') => {
                self.position = 1;
                self.negative = sign == b'-';
            }
            _ => self.discarded = discarded.saturating_add(1),
        }
    }

    /// Takes a later character of the line; `false` if it cannot stand there.
    fn take(&mut self, byte: u8) -> bool {
        match (self.position, byte) {
            (1 | 2, b' ') => !self.in_number,
            (1..=3 | 5 | 6, b'0'..=b'9') => {
                self.in_number = true;
                let digit = i32::from(byte.wrapping_sub(b'0'));
                // At most five digits.
                self.magnitude = self.magnitude.wrapping_mul(10).wrapping_add(digit);
                true
            }
            (4, b'.') | (7, b'\r') | (8, b'\n') => true,
            _ => false,
        }
    }
}

impl fmt::Display for BeyondHalfTurn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} hundredths of a degree are not within half a turn", self.0)
    }
}

impl fmt::Display for LineFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::LineErrors { errors } => write!(f, "receiver errors: {errors:?}"),
            Self::Unexpected { byte, position } => {
                write!(f, "character {byte:02X} at position {position} of a line")
            }
            Self::Value { centideg } => write!(f, "{centideg} hundredths of a degree exceed half a turn"),
        }
    }
}

impl core::error::Error for BeyondHalfTurn {}
impl core::error::Error for LineFault {}
