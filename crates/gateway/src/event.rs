//! What comes to the gateway core and what it hands out: events of a line as they wait in a queue, captures, actions of a
//! port, requesters.

use clino_bus::{Event, Instant, Timing, line};
use clino_codec::character::Character;
use clino_codec::pwm::Ticks;

use crate::stamp::ShortStamp;

/// An event of a line while it waits in a queue: 6 bytes instead of 12.
///
/// Its time is a short stamp (`stamp.rs`): it has to be taken out within 15 s. A level that does not do so for half a second is
/// reset by the watchdog.
#[derive(Clone, Copy, Debug)]
pub struct QueuedEvent {
    at: ShortStamp,
    what: What,
}

/// An [`Event`] without its time.
#[derive(Clone, Copy, Debug)]
enum What {
    Released,
    Forced,
    GivenUp,
    Heard(Character),
    Echo,
    Contention,
}

impl From<Event> for QueuedEvent {
    fn from(event: Event) -> QueuedEvent {
        let (what, at) = match event {
            Event::Released { at } => (What::Released, at),
            Event::Forced { at } => (What::Forced, at),
            Event::GivenUp { at } => (What::GivenUp, at),
            Event::Heard { character, at } => (What::Heard(character), at),
            Event::Echo { at } => (What::Echo, at),
            Event::Contention { at } => (What::Contention, at),
        };
        QueuedEvent { at: ShortStamp::of(at), what }
    }
}

impl QueuedEvent {
    /// The event, as it is taken out at `now`.
    pub fn event(self, now: Instant) -> Event {
        let at = self.at.near(now);
        match self.what {
            What::Released => Event::Released { at },
            What::Forced => Event::Forced { at },
            What::GivenUp => Event::GivenUp { at },
            What::Heard(character) => Event::Heard { character, at },
            What::Echo => Event::Echo { at },
            What::Contention => Event::Contention { at },
        }
    }
}

/// What a timer input saw. Raw: the law that makes an angle of it is the codec's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Capture {
    /// One whole cycle, rising edge to rising edge.
    Cycle(Ticks),
    /// An edge was not read before the next one overwrote it; the cycle is not trustworthy.
    LostEdge,
    /// No edge for longer than any legal period; the pin sits at this level.
    NoSignal {
        /// The pin is high.
        high: bool,
    },
}

/// What a bus's port has to do for the gateway.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action<'a> {
    /// Send this frame.
    Send(&'a [u8]),
    /// Run with this bit rate and these waits from now on.
    Run(Timing, line::LineSettings),
}

/// The interface an order comes from. The outcome of a task is reported to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Requester {
    /// The console.
    Console,
    /// The Modbus master.
    Modbus,
}
