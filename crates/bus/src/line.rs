//! The half-duplex line: when the driver is on, which character goes out next, when the line is ours again.
//!
//! ```text
//!            submit            guard over            no character left          transmission complete
//!  Listening ───────▶ Turnaround ────────▶ Sending ──────────────────▶ Draining ─────────────────────▶ Listening
//!      ▲             (driver off)     (driver on, DE high)            (driver on)                   (driver off)
//!      └── line not silent: given up       └──────────── held too long: forced ────────────────────▶
//! ```
//!
//! The driver is released on *transmission complete* of the last character, never when the last character was
//! merely accepted by the UART. A line that is not sending is always listening.
//!
//! Limits: one frame of at most [`MAX_FRAME`] characters at a time; the driver is never held longer than the
//! frame needs plus [`HOLD_MARGIN`] of its length.

use clino_codec::character::Character;
use heapless::Vec;

use crate::{Micros, Serial};

/// Longest frame of either vendor: the ISU's length byte counts up to 255, but the longest message anyone
/// sends is a write of the eight checksum words (20 bytes); the T7's longest is its 34-byte answer.
pub const MAX_FRAME: usize = 40;

/// The driver may be on for the frame's own time plus this part of it (numerator, denominator), at least one
/// character: an interrupt held off that long is a fault, not jitter.
pub const HOLD_MARGIN: (u64, u64) = (1, 4);

/// Why a frame was not accepted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SubmitError {
    /// The previous frame is still waiting or on its way.
    Busy,
    /// More characters than [`MAX_FRAME`], or none at all.
    Length(usize),
}

/// What the hardware has to do next. Nothing is to be done where no step is returned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum Step {
    /// Raise DE, then ask for the next character each time the transmit register is empty.
    Begin,
    /// The line was held too long: drop DE now, stop transmitting.
    Force,
    /// The line did not fall silent in time; the frame was dropped before its first character.
    GiveUp,
}

/// What happened on the line, in order, for the [`Master`](crate::Master).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The last stop bit of our frame is out and the driver is off.
    Released {
        /// When DE fell.
        at: Micros,
    },
    /// The driver was on for too long and was switched off by force; the frame is not out whole.
    Forced {
        /// When DE was forced low.
        at: Micros,
    },
    /// Our frame was dropped before its first character, because somebody else kept talking.
    GivenUp {
        /// When it was dropped.
        at: Micros,
    },
    /// A character was received.
    Heard {
        /// The character with the receiver's error flags.
        character: Character,
        /// Centre of its stop bit.
        at: Micros,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Listening,
    Turnaround { give_up: Micros },
    Sending { next: usize, release_by: Micros },
    Draining { release_by: Micros },
}

/// A half-duplex line. See the module documentation.
#[derive(Debug)]
pub struct Line {
    serial: Serial,
    guard: Micros,
    state: State,
    frame: Vec<u8, MAX_FRAME>,
    /// No DE before this instant: the end of the last thing heard or sent, plus the guard.
    clear_at: Micros,
}

impl Line {
    /// A listening line. `guard` is the silence between anything heard and our next DE. A UART whose transmitter
    /// was switched on at `started` first sends one character of idle line by itself (RM0090 section 30.3.2), which
    /// has to be over before DE rises.
    pub fn new(serial: Serial, guard: Micros, started: Micros) -> Line {
        let clear_at = started + guard.max(serial.characters(1));
        Line { serial, guard, state: State::Listening, frame: Vec::new(), clear_at }
    }

    /// Takes a frame to be sent as soon as the guard allows, and to be dropped if it does not by `give_up`.
    pub fn submit(&mut self, bytes: &[u8], give_up: Micros) -> Result<(), SubmitError> {
        if self.state != State::Listening {
            return Err(SubmitError::Busy);
        }
        match Vec::from_slice(bytes) {
            Ok(frame) if !frame.is_empty() => self.frame = frame,
            _ => return Err(SubmitError::Length(bytes.len())),
        }
        self.state = State::Turnaround { give_up };
        Ok(())
    }

    /// Lets time pass: says when to raise DE, and when it has been up for too long.
    pub fn poll(&mut self, now: Micros) -> Option<Step> {
        match self.state {
            State::Turnaround { .. } if now >= self.clear_at => {
                self.state = State::Sending { next: 0, release_by: now + self.longest_hold() };
                Some(Step::Begin)
            }
            State::Turnaround { give_up } if now >= give_up => {
                self.state = State::Listening;
                Some(Step::GiveUp)
            }
            State::Sending { release_by, .. } | State::Draining { release_by } if now >= release_by => {
                self.listen(now);
                Some(Step::Force)
            }
            _ => None,
        }
    }

    /// When [`Line::poll`] has something to do, if ever.
    pub fn poll_at(&self) -> Option<Micros> {
        match self.state {
            State::Listening => None,
            State::Turnaround { give_up } => Some(self.clear_at.min(give_up)),
            State::Sending { release_by, .. } | State::Draining { release_by } => Some(release_by),
        }
    }

    /// The transmit register is empty: the next character, or `None` when the last one is already in it and
    /// only *transmission complete* is left to wait for.
    pub fn next_character(&mut self) -> Option<u8> {
        let State::Sending { next, release_by } = self.state else { return None };
        match self.frame.get(next) {
            Some(&byte) => {
                self.state = State::Sending { next: next.saturating_add(1), release_by };
                Some(byte)
            }
            None => {
                self.state = State::Draining { release_by };
                None
            }
        }
    }

    /// Transmission complete. `true` when this was the end of the frame: drop DE now. `false` when it was not
    /// ours to act on (the transmitter ran dry in the middle of a frame, or a stale flag).
    #[must_use]
    pub fn transmission_complete(&mut self, now: Micros) -> bool {
        let finished = matches!(self.state, State::Draining { .. });
        if finished {
            self.listen(now);
        }
        finished
    }

    /// A character was received; `at` is the centre of its stop bit.
    pub fn heard(&mut self, at: Micros) {
        let end_of_stop_bit = at + self.serial.half_bit();
        self.clear_at = self.clear_at.max(end_of_stop_bit + self.guard);
    }

    /// Whether the driver is to be on.
    pub fn driving(&self) -> bool {
        matches!(self.state, State::Sending { .. } | State::Draining { .. })
    }

    /// Characters of the frame in hand.
    pub fn frame_len(&self) -> usize {
        self.frame.len()
    }

    fn listen(&mut self, now: Micros) {
        self.state = State::Listening;
        self.clear_at = self.clear_at.max(now + self.guard);
    }

    fn longest_hold(&self) -> Micros {
        let frame = self.serial.characters(self.frame.len() as u64);
        let (numerator, denominator) = HOLD_MARGIN;
        let margin = Micros(frame.times(numerator).0.checked_div(denominator).unwrap_or(0));
        frame + margin.max(self.serial.characters(1))
    }
}

#[cfg(test)]
mod tests;
