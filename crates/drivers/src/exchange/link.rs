//! What a driver knows of its line from one exchange to the next: the time that it has waited, and what it has heard.

use clino_bus::{Duration, Instant, Retry, Serial};
use clino_codec::character::Character;

use super::witness::{Heard, History};

/// Characters after which the time that they took is added up: a [`Duration`] holds it at 300 bit/s and above.
const MOST_COUNTED: u32 = 100_000;

/// See the module documentation.
pub struct Link {
    pub now: Instant,
    /// The driver of the last frame went off.
    pub released: Instant,
    /// Characters heard since.
    heard: u32,
    /// What was heard since.
    pub witness: Heard,
    pub history: History,
    /// The last frame did not get out whole.
    pub half_sent: bool,
    /// There is one sensor on the line, and no other.
    pub single: bool,
    /// The longest wait in one piece, where the port cannot say when a character came.
    pub piece: Option<Duration>,
    pub retry: Retry,
    /// [`Sensor::COMMAND_TIMEOUT`](super::Sensor::COMMAND_TIMEOUT).
    pub command_timeout: Duration,
}

impl Link {
    pub fn new(single: bool, command_timeout: Duration) -> Self {
        Self {
            now: Instant::ZERO,
            released: Instant::ZERO,
            heard: 0,
            witness: Heard::default(),
            history: History::default(),
            half_sent: false,
            single,
            piece: None,
            retry: Retry::NEVER,
            command_timeout,
        }
    }

    /// A character came `after` the beginning of the span that is listened to. Returns when that was, and which time has
    /// passed for certain.
    pub fn hear(&mut self, character: Character, after: Duration, serial: Serial) -> (Instant, Instant) {
        self.witness.take(character);
        self.history.take(character, self.now + after, self.piece.is_none());
        self.heard = self.heard.saturating_add(1);
        if self.heard > MOST_COUNTED {
            self.heard = self.heard.saturating_sub(MOST_COUNTED);
            self.released = self.released + serial.characters(MOST_COUNTED);
        }
        // The first may have begun before our driver was off.
        let proven = self.released + serial.characters(self.heard.saturating_sub(1));
        ((self.now + after).max(proven), proven)
    }

    /// A frame is out, or did not get out whole.
    pub fn sent(&mut self, whole: bool) {
        (self.released, self.heard, self.half_sent) = (self.now, 0, !whole);
        self.witness = Heard::default();
    }

    /// The span until then, or a piece of it.
    pub fn until(&self, at: Instant) -> Duration {
        let span = at.since(self.now);
        self.piece.map_or(span, |piece| piece.max(Duration::from_micros(1)).min(span))
    }
}
