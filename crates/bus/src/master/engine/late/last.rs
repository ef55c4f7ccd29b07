//! No list, but how long a reply may be outstanding: nothing else is asked meanwhile.

use super::OutstandingReply;
use crate::{ExpectedReply, Instant, ReplyHeader};

/// No reply to a failed request begins after this.
pub struct OutstandingReplies(Instant);

/// A reply to one of them, unknown which.
pub struct Reply;

impl OutstandingReplies {
    pub fn new() -> OutstandingReplies {
        OutstandingReplies(Instant::ZERO)
    }

    /// Adds a request.
    pub fn add(&mut self, reply: OutstandingReply) {
        self.0 = self.0.max(reply.until);
    }

    /// When any request may be sent: an instant that has passed for at once.
    pub fn clear_at(&self, _: &ExpectedReply) -> Instant {
        self.0
    }

    /// An answer came during the request begun at `asked`. If that was too early, it counts as one to an earlier request, as
    /// all that come.
    pub fn claim(&mut self, asked: Instant, _: ReplyHeader) -> Option<Reply> {
        (self.0 > asked).then_some(Reply)
    }
}

impl Reply {
    pub fn known(&self) -> Option<&OutstandingReply> {
        None
    }
}
