//! The errors of a line, its steps for the hardware, and its events for the master.

use clino_codec::character::Character;

#[cfg(doc)]
use super::{Line, MAX_FRAME};
use crate::Instant;

/// Why a frame, or a change of settings, was not accepted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SubmitError {
    /// The previous frame is still waiting or on its way.
    Busy,
    /// More characters than [`MAX_FRAME`], or none at all.
    Length(usize),
}

/// The next step of the hardware, besides setting DE to [`Line::driving`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum LineStep {
    /// Ask for the next character each time the transmit register is empty, beginning now.
    Begin,
    /// The line was held too long: stop transmitting.
    Force,
    /// Nothing. The line did not fall silent in time; the frame was dropped before its first character.
    GiveUp,
    /// Nothing. A part of our frame did not come back, though there is an echo.
    EchoLost,
}

impl LineStep {
    /// What this means for the [`Master`](crate::Master).
    pub const fn event(self, at: Instant) -> Option<Event> {
        match self {
            LineStep::Begin => None,
            LineStep::Force => Some(Event::Forced { at }),
            LineStep::GiveUp => Some(Event::GivenUp { at }),
            LineStep::EchoLost => Some(Event::Contention { at }),
        }
    }
}

/// What happened on the line, in order, for the [`Master`](crate::Master).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The last stop bit of our frame is out: the line is the others'. The driver is off, or will be after the
    /// post-delay.
    Released {
        /// When transmission was complete.
        at: Instant,
    },
    /// The driver was on for too long and was switched off by force; the frame is not out whole.
    Forced {
        /// When DE was forced low.
        at: Instant,
    },
    /// Our frame was dropped before its first character, because another node kept transmitting.
    GivenUp {
        /// When it was dropped.
        at: Instant,
    },
    /// A character of another node was received.
    Heard {
        /// The character with the receiver's error flags.
        character: Character,
        /// Centre of its stop bit.
        at: Instant,
    },
    /// A character of ours came back as it was sent.
    Echo {
        /// Centre of its stop bit.
        at: Instant,
    },
    /// A character of ours came back changed, or not at all: another node transmitted during our frame.
    Contention {
        /// When it showed.
        at: Instant,
    },
}
