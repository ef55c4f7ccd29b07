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

use crate::{Duration, ExpectedReply, Instant, ReplyHeader, Serial};

/// More than the unanswered T7 requests that fit into the 25 ms for which one reply is outstanding, at 2.4 ms each.
const MAX_OUTSTANDING: usize = 12;

#[derive(Clone, Copy)]
pub(super) struct OutstandingReply {
    pub expected: ExpectedReply,
    /// When the answer should have begun, by the sensor's document.
    pub due: Instant,
    /// No answer begins after this.
    pub until: Instant,
}

impl OutstandingReply {
    /// How long after it was due an answer began that ended at `at`.
    pub fn lateness(&self, at: Instant, serial: Serial) -> Duration {
        at.since(self.due + serial.characters(self.expected.characters.into()))
    }
}

/// Failed requests whose replies are outstanding, in any order.
#[derive(Default)]
pub(super) struct OutstandingReplies {
    // Places, not a list: nothing is moved, and moving takes 1.6 KB of flash where nothing else does it.
    places: [Option<OutstandingReply>; MAX_OUTSTANDING],
}

impl OutstandingReplies {
    /// Adds a request and removes those whose time is over at `now`.
    pub fn add(&mut self, reply: OutstandingReply, now: Instant) {
        for place in &mut self.places {
            *place = place.filter(|reply| reply.until > now);
        }
        // Only a caller that ignored `may_ask` finds no place free, and takes that of the oldest.
        if let Some(place) = self.places.iter_mut().min_by_key(|place| place.map(|reply| reply.until)) {
            *place = Some(reply);
        }
    }

    /// When a request for `expected` may be sent, so that its answer cannot be confused with an outstanding one.
    pub fn clear_at(&self, expected: &ExpectedReply) -> Instant {
        let mut clear = Instant::ZERO;
        let mut oldest = Some(Instant::NEVER);
        for place in &self.places {
            oldest = place.and_then(|reply| oldest.map(|oldest| oldest.min(reply.until)));
            if let Some(reply) = place.filter(|reply| expected.is_confusable_with(&reply.expected)) {
                clear = clear.max(reply.until);
            }
        }
        clear.max(oldest.unwrap_or(Instant::ZERO))
    }

    /// An answer with this header came during the request begun at `asked`. Removes and returns the earlier request that
    /// it fits, the oldest if there are several.
    pub fn claim(&mut self, asked: Instant, header: ReplyHeader) -> Option<OutstandingReply> {
        let fitting = self.places.iter_mut().filter_map(|place| {
            let until = place.filter(|reply| reply.until > asked && reply.expected.fits(header))?.until;
            Some((until, place))
        });
        fitting.min_by_key(|&(until, _)| until)?.1.take()
    }
}
