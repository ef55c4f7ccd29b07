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
    const NONE: OutstandingReply =
        OutstandingReply { expected: ExpectedReply::NONE, due: Instant::ZERO, until: Instant::ZERO };

    /// How long after it was due an answer began that ended at `at`.
    pub fn lateness(&self, at: Instant, serial: Serial) -> Duration {
        at.since(self.due + serial.characters(self.expected.characters.into()))
    }
}

/// Failed requests whose replies are outstanding, in any order. A place is free when its time is over; that of one never used
/// was over from the beginning.
// Places, not a list: nothing is moved, and moving takes 1.6 KB of flash where nothing else does it.
pub(super) struct OutstandingReplies([OutstandingReply; MAX_OUTSTANDING]);

impl OutstandingReplies {
    pub fn new() -> OutstandingReplies {
        OutstandingReplies([OutstandingReply::NONE; MAX_OUTSTANDING])
    }

    /// Adds a request. Only a caller that ignored `may_ask` finds no place free, and takes that of the oldest.
    pub fn add(&mut self, reply: OutstandingReply) {
        if let Some(place) = self.0.iter_mut().min_by_key(|place| place.until) {
            *place = reply;
        }
    }

    /// When a request for `expected` may be sent, so that its answer cannot be confused with an outstanding one: an instant
    /// that has passed for at once.
    pub fn clear_at(&self, expected: &ExpectedReply) -> Instant {
        let (mut clear, mut oldest) = (Instant::ZERO, Instant::NEVER);
        for reply in &self.0 {
            oldest = oldest.min(reply.until);
            if expected.is_confusable_with(&reply.expected) {
                clear = clear.max(reply.until);
            }
        }
        clear.max(oldest)
    }

    /// An answer with this header came during the request begun at `asked`. Removes and returns the earlier request that
    /// it fits, the oldest if there are several.
    pub fn claim(&mut self, asked: Instant, header: ReplyHeader) -> Option<OutstandingReply> {
        let outstanding =
            self.0.iter_mut().filter(|reply| reply.until > asked && reply.expected.fits(header));
        let oldest = outstanding.min_by_key(|reply| reply.until)?;
        Some(core::mem::replace(oldest, OutstandingReply::NONE))
    }
}
