//! What nodes did when they were asked last, and how long to leave the line to one that has missed its deadline.
//!
//! A late answer that meets the next request spoils both, and worse: other nodes take the pieces for the beginning of a
//! long command and hear nothing for half a second. So a node that answered the last time is given
//! [`Timing::patience`] before anybody else is asked, and a node that has been late before gets [`Timing::late`]. A node
//! that did not answer the last time is taken for dead, and gets no more than [`Timing::quiet`]: that is what keeps dead
//! nodes cheap.
//!
//! [`Timing::patience`]: crate::Timing::patience
//! [`Timing::late`]: crate::Timing::late
//! [`Timing::quiet`]: crate::Timing::quiet

use crate::{Micros, Timing};

/// One bit a node, by its address; no protocol has more than 128 of them.
#[derive(Default)]
pub(super) struct Habits {
    answered: u128,
    late: u128,
}

impl Habits {
    /// The node has answered in time.
    pub fn answered(&mut self, node: u8) {
        self.answered |= bit(node);
    }

    /// The node has answered, but late.
    pub fn late(&mut self, node: u8) {
        self.late |= bit(node);
    }

    /// The node has missed its deadline: for how long the line is left to it. Until it is heard of again it is taken
    /// for dead.
    pub fn missed(&mut self, node: u8, timing: &Timing) -> Micros {
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
