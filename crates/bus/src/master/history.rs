//! Node history: how each node answered its last request, and how long the line stays free after a missed deadline.
//!
//! A late answer that collides with the next request spoils both. Other nodes may also take the fragments for the start
//! of a long command and hear nothing for half a second. After a missed deadline the master therefore waits
//! [`Timing::patience`] for a node that answered its last request, [`Timing::late`] for a node that was late before, and
//! only [`Timing::quiet`] for a node that did not answer its last request: it counts as dead, and dead nodes must cost
//! little time.
//!
//! [`Timing::patience`]: crate::Timing::patience
//! [`Timing::late`]: crate::Timing::late
//! [`Timing::quiet`]: crate::Timing::quiet

use crate::{Duration, Timing};

/// One bit for each node address; no protocol has more than 128.
#[derive(Default)]
pub(super) struct NodeHistory {
    answered: u128,
    late: u128,
}

impl NodeHistory {
    /// The node has answered in time.
    pub fn answered(&mut self, node: u8) {
        self.answered |= bit(node);
    }

    /// The node has answered, but late.
    pub fn late(&mut self, node: u8) {
        self.late |= bit(node);
    }

    /// The node has missed its deadline. Returns how long the line stays free for it. The node counts as dead until it
    /// answers again.
    pub fn missed(&mut self, node: u8, timing: &Timing) -> Duration {
        let patience = match (self.late & bit(node) != 0, self.answered & bit(node) != 0) {
            (true, _) => timing.late,
            (false, true) => timing.patience,
            (false, false) => timing.quiet,
        };
        self.answered &= !bit(node);
        self.late &= !bit(node);
        patience.max(timing.quiet)
    }
}

fn bit(node: u8) -> u128 {
    1_u128.checked_shl(node.into()).unwrap_or(0)
}
