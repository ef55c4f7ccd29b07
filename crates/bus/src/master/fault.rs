//! Why there is no answer, and whose fault it is.

use clino_codec::checks::Check;

use crate::line::SubmitError;
use crate::{Duration, FailedCheck};

/// Why there is no answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault<E> {
    /// The line stayed silent until the deadline.
    NoAnswer {
        /// From our last stop bit to the deadline.
        waited: Duration,
    },
    /// Characters came, but no frame.
    Garbled {
        /// How many.
        characters: u32,
    },
    /// A frame came, but not the awaited one, or it failed a check.
    Bad(E),
    /// Another node transmitted during our frame, as its echo showed, and no good answer came.
    Contention,
    /// Another node kept transmitting: our frame was dropped before its first character.
    LineBusy,
    /// Our own frame did not get out whole: the driver was switched off by force, or the line never said how the frame
    /// ended.
    NotSent,
    /// The window of a collecting exchange is over; its answers were reported one by one.
    Over {
        /// Good answers reported.
        answers: u32,
        /// Faults reported: several nodes may have talked at once.
        garbled: u32,
    },
}

/// Where to look for the cause of an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Blame {
    /// The node that was asked, its supply or its plug: it is silent, or it says what it should not.
    Node,
    /// The line: noise, termination, bias, two nodes at one address, another master.
    Line,
    /// This master's own hardware or software: interrupts held off for too long.
    Ourselves,
    /// The caller: such a request cannot be sent. No [`Fault`] is of this kind, because nothing was sent.
    Request,
}

impl<E: FailedCheck> Fault<E> {
    /// The same, with nothing but the check that failed.
    pub fn by_check(&self) -> Fault<Check> {
        match *self {
            Fault::NoAnswer { waited } => Fault::NoAnswer { waited },
            Fault::Garbled { characters } => Fault::Garbled { characters },
            Fault::Bad(ref error) => Fault::Bad(error.failed_check()),
            Fault::Contention => Fault::Contention,
            Fault::LineBusy => Fault::LineBusy,
            Fault::NotSent => Fault::NotSent,
            Fault::Over { answers, garbled } => Fault::Over { answers, garbled },
        }
    }

    /// Where to look for the cause.
    pub fn blame(&self) -> Blame {
        match self {
            Fault::NoAnswer { .. } | Fault::Over { answers: 0, garbled: 0 } => Blame::Node,
            Fault::Garbled { .. } | Fault::Contention | Fault::LineBusy | Fault::Over { .. } => Blame::Line,
            Fault::NotSent => Blame::Ourselves,
            Fault::Bad(error) => match error.failed_check() {
                Check::LineErrors | Check::Checksum => Blame::Line,
                Check::Address | Check::Command | Check::Length | Check::Value => Blame::Node,
            },
        }
    }
}

impl<E> Fault<E> {
    /// Whether the node has certainly not received the request, so that it can be repeated even if it writes.
    pub fn request_unheard(&self) -> bool {
        matches!(self, Fault::LineBusy)
    }
}

impl SubmitError {
    /// Where to look for the cause.
    pub const fn blame(&self) -> Blame {
        match self {
            SubmitError::Busy => Blame::Ourselves,
            SubmitError::Length(_) => Blame::Request,
        }
    }
}
