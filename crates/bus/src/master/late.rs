//! Outstanding replies: requests that were not answered in time and may still be answered.
//!
//! A late answer looks like the answer to a repetition of the same request; only time tells them apart. The reply to a
//! failed request stays *outstanding* until an answer to it is recognised as late, or until [`Timing::late`] after its
//! deadline. Until then an answer that fits this request counts as late, whatever was asked since, and is not used. To
//! lose no time, a master meanwhile asks what cannot be confused with it: other nodes, or other commands.
//!
//! Limits: an answer that begins after [`Timing::late`] is taken for the answer to a later request. At most
//! [`MAX_OUTSTANDING`] replies are outstanding at once; the next request then waits until the oldest has expired.
//!
//! [`Timing::late`]: crate::Timing

use heapless::Vec;

use crate::{Duration, Instant, Protocol, Serial};

/// More than the unanswered T7 requests that fit into the 25 ms for which one reply is outstanding, at 2.4 ms each.
const MAX_OUTSTANDING: usize = 12;

#[derive(Clone, Copy)]
pub(super) struct OutstandingReply<E> {
    pub expected: E,
    /// When the answer should have begun, by the sensor's document.
    pub due: Instant,
    /// No answer begins after this.
    pub until: Instant,
}

impl<E> OutstandingReply<E> {
    /// How long after it was due an answer began that ended at `at`.
    pub fn lateness<P: Protocol<Expected = E>>(&self, at: Instant, serial: Serial) -> Duration {
        at.since(self.due + serial.characters(P::size(&self.expected) as u32))
    }
}

/// Failed requests whose replies are outstanding, oldest first.
pub(super) struct OutstandingReplies<P: Protocol> {
    list: Vec<OutstandingReply<P::Expected>, MAX_OUTSTANDING>,
}

impl<P: Protocol> OutstandingReplies<P> {
    pub const fn new() -> Self {
        OutstandingReplies { list: Vec::new() }
    }

    /// Adds a request and removes those whose time is over at `now`.
    pub fn add(&mut self, reply: OutstandingReply<P::Expected>, now: Instant) {
        self.list.retain(|reply| reply.until > now);
        if self.list.is_full() {
            // Only a caller that ignored `may_ask` comes here.
            _ = self.take(0);
        }
        _ = self.list.push(reply);
    }

    /// When a request for `expected` may be sent, so that its answer cannot be confused with an outstanding one.
    pub fn clear_at(&self, expected: &P::Expected) -> Instant {
        let confusable = self.list.iter().filter(|reply| P::confusable(expected, &reply.expected));
        let room = if self.list.is_full() { self.list.first() } else { None };
        confusable.chain(room).map(|reply| reply.until).max().unwrap_or(Instant::ZERO)
    }

    /// An answer came during the request begun at `asked`; `fits` says whether it fits an earlier request. Removes and
    /// returns the earlier request that it fits, if there is one.
    pub fn claim(
        &mut self,
        asked: Instant,
        fits: impl Fn(&P::Expected) -> bool,
    ) -> Option<OutstandingReply<P::Expected>> {
        let index = self.list.iter().position(|reply| reply.until > asked && fits(&reply.expected))?;
        self.take(index)
    }

    /// Takes one out; the later ones move up. One by one: `Vec::remove` needs the 1.5 KB of `memmove`.
    fn take(&mut self, index: usize) -> Option<OutstandingReply<P::Expected>> {
        let mut carried = self.list.pop()?;
        self.list.iter_mut().skip(index).rev().for_each(|place| core::mem::swap(place, &mut carried));
        Some(carried)
    }
}
