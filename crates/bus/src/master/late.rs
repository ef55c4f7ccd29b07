//! Requests that were not answered in time, and may be still.
//!
//! Nothing in a late answer tells it from the answer to a repetition of the same request, so time has to. A request
//! that failed stays *in doubt* until an answer to it was recognised as late, or until [`Timing::late`] after its
//! deadline. While it is, an answer that it may have called for is late, whatever was asked since, and is not used. So
//! that this costs nothing, a master asks in the meantime what cannot be confused with it: other nodes, or other
//! commands.
//!
//! Limits: an answer that begins later than that is taken for what it looks like; at most [`MAX_DOUBTS`] requests
//! are in doubt at once, and then nothing is asked until the oldest of them is not.
//!
//! [`Timing::late`]: crate::Timing

use heapless::Vec;

use crate::{Micros, Protocol, Serial};

/// More than the unanswered T7 requests that fit into the time in which one of them is in doubt: 25 ms, at 2.4 ms each.
const MAX_DOUBTS: usize = 12;

#[derive(Clone, Copy)]
pub(super) struct Doubt<E> {
    pub expected: E,
    /// When the answer should have begun, by the sensor's document.
    pub due: Micros,
    /// No answer begins after this.
    pub until: Micros,
}

impl<E> Doubt<E> {
    /// How long after it was due an answer began that ended at `at`.
    pub fn lateness<P: Protocol<Expected = E>>(&self, at: Micros, serial: Serial) -> Micros {
        at.since(self.due + serial.characters(P::size(&self.expected) as u64))
    }
}

/// The requests in doubt, oldest first.
pub(super) struct Doubts<P: Protocol> {
    list: Vec<Doubt<P::Expected>, MAX_DOUBTS>,
}

impl<P: Protocol> Doubts<P> {
    pub const fn new() -> Self {
        Doubts { list: Vec::new() }
    }

    /// Remembers a request. Those that are not in doubt any more at `now` go.
    pub fn add(&mut self, doubt: Doubt<P::Expected>, now: Micros) {
        self.list.retain(|doubt| doubt.until > now);
        if self.list.is_full() {
            // Only a caller who did not ask when he may comes here.
            self.list.remove(0);
        }
        _ = self.list.push(doubt);
    }

    /// From when on a request for `expected` can be asked without doubt about its answer.
    pub fn clear_at(&self, expected: &P::Expected) -> Micros {
        let confusable = self.list.iter().filter(|doubt| P::confusable(expected, &doubt.expected));
        let room = if self.list.is_full() { self.list.first() } else { None };
        confusable.chain(room).map(|doubt| doubt.until).max().unwrap_or(Micros::ZERO)
    }

    /// An answer came, to a request begun at `asked`; `fits` says whether it may belong to an earlier one. If it does,
    /// returns that, no more in doubt.
    pub fn claim(
        &mut self,
        asked: Micros,
        fits: impl Fn(&P::Expected) -> bool,
    ) -> Option<Doubt<P::Expected>> {
        let index = self.list.iter().position(|doubt| doubt.until > asked && fits(&doubt.expected))?;
        Some(self.list.remove(index))
    }
}
