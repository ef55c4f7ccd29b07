//! Outstanding replies: requests that were not answered in time and may still be answered.
//!
//! A late answer looks like the answer to a repetition of the same request; only time tells them apart. The reply to a
//! failed request stays *outstanding* until an answer to it is recognised as late, or until [`Timing::late`] after its
//! deadline. Until then an answer that fits this request counts as late, whatever was asked since, and is not used. To
//! lose no time, a master meanwhile asks what cannot be confused with it: other nodes, or other commands.
//!
//! Without the feature `many-nodes` there is no list (`late/last.rs`): no request is asked while any answer is outstanding.
//!
//! Limit: an answer that begins after [`Timing::late`] is taken for the answer to a later request.
//!
//! [`Timing::late`]: crate::Timing

use crate::{Duration, ExpectedReply, Instant, Serial};

#[cfg(not(feature = "many-nodes"))]
mod last;
#[cfg(feature = "many-nodes")]
mod list;

#[cfg(not(feature = "many-nodes"))]
pub(super) use last::{OutstandingReplies, Reply};
#[cfg(feature = "many-nodes")]
pub(super) use list::{OutstandingReplies, Reply};

#[derive(Clone, Copy)]
pub(super) struct OutstandingReply {
    pub expected: ExpectedReply,
    /// When the answer should have begun, by the sensor's document.
    pub due: Instant,
    /// No answer begins after this.
    pub until: Instant,
}

impl OutstandingReply {
    #[cfg(feature = "many-nodes")]
    const NONE: OutstandingReply =
        OutstandingReply { expected: ExpectedReply::NONE, due: Instant::ZERO, until: Instant::ZERO };

    /// Which it is: known, with a list.
    #[cfg(feature = "many-nodes")]
    pub fn known(&self) -> Option<&OutstandingReply> {
        Some(self)
    }

    /// How long after it was due an answer began that ended at `at`.
    pub fn lateness(&self, at: Instant, serial: Serial) -> Duration {
        at.since(self.due + serial.characters(self.expected.characters.into()))
    }
}
