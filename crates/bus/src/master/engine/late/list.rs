//! A list of outstanding replies: other requests are asked meanwhile.
//!
//! At most [`MAX_OUTSTANDING`] replies are outstanding at once; the next request then waits until the oldest has expired.

use super::OutstandingReply;
use crate::{ExpectedReply, Instant, ReplyHeader};

/// More than the unanswered T7 requests that fit into the 25 ms for which one reply is outstanding, at 2.4 ms each.
const MAX_OUTSTANDING: usize = 12;

/// A reply to one of them.
pub type Reply = OutstandingReply;

/// Failed requests whose replies are outstanding, in any order. A place is free when its time is over; that of one never used
/// was over from the beginning.
// Places, not a list: nothing is moved, and moving takes 1.6 KB of flash where nothing else does it.
pub struct OutstandingReplies([OutstandingReply; MAX_OUTSTANDING]);

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
    pub fn claim(&mut self, asked: Instant, header: ReplyHeader) -> Option<Reply> {
        let outstanding =
            self.0.iter_mut().filter(|reply| reply.until > asked && reply.expected.fits(header));
        let oldest = outstanding.min_by_key(|reply| reply.until)?;
        Some(core::mem::replace(oldest, OutstandingReply::NONE))
    }
}
