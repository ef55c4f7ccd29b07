//! Time on a port that has no clock, what is heard as it passes, and how the last frame got out: the same for all protocols.
//!
//! Time is what the port has waited. Between calls, and while the code itself runs, it stands still: every wait lasts
//! at least as long as its figure, and longer by what the code takes. Received characters prove the passing of time,
//! too: `n` of them take as long as `n` characters last, so that no babble lasts for ever on a slow processor.

use clino_bus::{Duration, Instant};
use clino_codec::character::Character;

use super::witness::{Heard, History};

const MICROSECOND: Duration = Duration::from_micros(1);

/// What a port without a clock has to be told.
pub struct Clock {
    pub now: Instant,
    /// The driver of the last frame went off.
    pub released: Instant,
    /// The characters heard since take so long that it is this late at least when the next one is heard.
    proven: Instant,
    /// What was heard since.
    pub witness: Heard,
    pub history: History,
    /// The last frame did not get out whole.
    pub half_sent: bool,
    /// The longest wait in one piece, where the port cannot say when a character came.
    pub piece: Option<Duration>,
}

/// When a character came.
pub struct Came {
    pub at: Instant,
    /// As far as those before it prove it.
    pub proven: Instant,
}

impl Clock {
    /// Of a port that says when a character came.
    pub fn new() -> Self {
        let (now, released, proven) = (Instant::ZERO, Instant::ZERO, Instant::ZERO);
        let (witness, history) = (Heard::default(), History::default());
        Self { now, released, proven, witness, history, half_sent: false, piece: None }
    }

    /// The longest wait in one piece. Only async ports do not know when a character came.
    pub fn piece(&self) -> Option<Duration> {
        self.piece.filter(|_| cfg!(feature = "async"))
    }

    /// How long to listen for, so as not to be later than this.
    #[inline(never)]
    pub fn until(&self, at: Instant) -> Duration {
        let span = at.since(self.now);
        self.piece().map_or(span, |piece| piece.max(MICROSECOND).min(span))
    }

    /// A character came so long `after` now; `one` is how long one lasts, and `may_be_text` whether sensors of this kind print
    /// lines.
    #[inline(never)]
    pub fn hear(&mut self, character: Character, after: Duration, one: Duration, may_be_text: bool) -> Came {
        self.witness.take(character);
        let passed = self.now + after;
        self.history.take(passed, self.piece().is_none());
        if may_be_text {
            self.history.read(character);
        }
        let proven = self.proven;
        // The next one proves that this one is over. Its time is rounded up: less a microsecond, it is not too long; and it
        // is never zero, so that babble ends.
        self.proven = proven + (one - MICROSECOND).longer(MICROSECOND);
        Came { at: passed.max(proven), proven }
    }

    /// The frame is out, or did not get out whole.
    pub fn sent(&mut self, whole: bool) {
        // The first character may have begun before our driver was off: it proves nothing.
        (self.released, self.proven, self.half_sent) = (self.now, self.now, !whole);
        self.witness = Heard::default();
    }
}
