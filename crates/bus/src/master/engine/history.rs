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

/// Nodes in a word.
const NODES: u8 = u32::BITS as u8;

/// One bit for each node address; no protocol has more than 128.
#[derive(Clone, Copy, Default)]
struct Nodes([u32; 4]);

impl Nodes {
    fn has(&self, node: u8) -> bool {
        let word = self.0.get(usize::from(node / NODES));
        word.is_some_and(|word| word & bit(node) != 0)
    }

    fn set(&mut self, node: u8, is_in: bool) {
        if let Some(word) = self.0.get_mut(usize::from(node / NODES)) {
            *word = if is_in { *word | bit(node) } else { *word & !bit(node) };
        }
    }
}

#[derive(Default)]
pub(super) struct NodeHistory {
    answered: Nodes,
    late: Nodes,
}

impl NodeHistory {
    /// The node has answered in time.
    pub fn answered(&mut self, node: u8) {
        self.answered.set(node, true);
    }

    /// The node has answered, but late.
    pub fn late(&mut self, node: u8) {
        self.late.set(node, true);
    }

    /// The node has missed its deadline. Returns how long the line stays free for it. The node counts as dead until it
    /// answers again.
    pub fn missed(&mut self, node: u8, timing: &Timing) -> Duration {
        let patience = match (self.late.has(node), self.answered.has(node)) {
            (true, _) => timing.late,
            (false, true) => timing.patience,
            (false, false) => timing.quiet,
        };
        self.answered.set(node, false);
        self.late.set(node, false);
        patience.max(timing.quiet)
    }
}

fn bit(node: u8) -> u32 {
    1 << (node % NODES)
}
