//! `history.rs` without the feature `many-nodes`: nothing is remembered, and each node counts as one that answered. A late
//! answer is waited for in any case (`late.rs`).

use crate::{Duration, Timing};

#[derive(Default)]
pub(super) struct NodeHistory {}

impl NodeHistory {
    pub fn answered(&mut self, _: u8) {}

    pub fn late(&mut self, _: u8) {}

    /// A node has missed its deadline. Returns how long the line stays free for it.
    pub fn missed(&mut self, _: u8, timing: &Timing) -> Duration {
        timing.patience.max(timing.quiet)
    }
}
