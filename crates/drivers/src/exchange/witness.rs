//! What was heard besides what the master counts, and what it suggests.

use core::array;

use clino_bus::{BusCounters, FailedCheck, Fault, Instant};
use clino_codec::character::Character;
use clino_codec::checks::Check;

use super::Sensor;
use crate::Suspect;

/// Characters of an answer that are kept. All that an echo of a reading T7 command has, and enough of any other.
const KEPT: usize = 4;

/// What came back to a request.
#[derive(Clone, Copy, Default)]
pub struct Heard {
    first: [u8; KEPT],
    /// All characters.
    count: u32,
}

impl Heard {
    pub fn take(&mut self, Character { byte, .. }: Character) {
        if let Some(place) = self.first.get_mut(self.count as usize) {
            *place = byte;
        }
        self.count = self.count.wrapping_add(1);
    }

    /// Whether it is this frame and nothing else.
    fn is(&self, frame: &[u8]) -> bool {
        // Without a loop: a program that does not look at its errors does without this then.
        let sent: [u8; KEPT] = array::from_fn(|place| frame.get(place).copied().unwrap_or(0));
        self.count as usize == frame.len() && self.first == sent
    }
}

/// Characters that a blocking port hands over at one time only if it has kept some of them. It looks at its receiver eight
/// times a character.
const BURST: u8 = 4;
/// The same for an async port, which has one time for all that comes within a [`Timing::gap`](clino_bus::Timing::gap) of
/// four characters (ISU: ten).
const BURST_ASYNC: u8 = 16;

/// What was heard since the driver was made.
#[derive(Clone, Copy, Default)]
pub struct History {
    characters: u32,
    /// The last four: an ISU's ASCII line ends with two digits, CR, LF. Source: AN #201 section 4, ASCII Output Mode.
    last: u32,
    ascii: bool,
    /// Characters came faster than a line can carry them: a receiver has kept them.
    bursts: bool,
    at: Instant,
    at_once: u8,
}

impl History {
    /// A character came that may be one of a line of text.
    pub fn read(&mut self, Character { byte, .. }: Character) {
        self.last = self.last << u8::BITS | u32::from(byte);
        self.ascii |= matches!(self.last.to_be_bytes(), [b'0'..=b'9', b'0'..=b'9', b'\r', b'\n']);
    }

    /// A character came at this time, as far as the port knows; `exact` if it looks often.
    pub fn take(&mut self, at: Instant, exact: bool) {
        self.characters = self.characters.wrapping_add(1);
        self.at_once = if at == self.at { self.at_once.saturating_add(1) } else { 1 };
        self.at = at;
        self.bursts |= self.at_once >= if exact { BURST } else { BURST_ASYNC };
    }
}

/// What to suspect when an exchange ends so. `sent` is its frame.
pub fn suspect<S: Sensor>(
    fault: &Fault<S::DecodeError>,
    sent: &[u8],
    heard: &Heard,
    history: &History,
    counters: &BusCounters,
) -> Suspect {
    if S::PRINTS_LINES && history.ascii {
        return Suspect::AsciiOutput;
    }
    if heard.is(sent) {
        return Suspect::OwnEcho;
    }
    let check = match fault {
        Fault::NoAnswer { .. } => None,
        Fault::Bad(error) => Some(error.failed_check()),
        _ => Some(Check::LineErrors),
    };
    let never = counters.good == 0;
    let most = |count: u32| count.saturating_mul(2) > history.characters;
    match check {
        _ if never && (counters.late > 0 || history.bursts) => Suspect::LateAnswers,
        None if counters.late > 0 => Suspect::LateAnswers,
        None if never => Suspect::NeverAnswered,
        None => Suspect::Silent,
        Some(Check::Address | Check::Command) => Suspect::Foreign,
        Some(_) if !never => Suspect::Noise,
        Some(_) if most(counters.breaks) => Suspect::LineLow,
        Some(_) if most(counters.framing) => Suspect::BitRate,
        Some(_) => Suspect::Collision,
    }
}
