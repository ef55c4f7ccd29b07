//! A node that stays in reach: hand one clone of the `Arc` to the line and keep the other to change faults,
//! look at settings or read the sent angles.
//!
//! The lock is held for the length of one call only. A poisoned lock is still used: the panic that
//! poisoned it already fails the run.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::node::{Burst, Heard, Node, Ns};

fn lock<N>(node: &Mutex<N>) -> MutexGuard<'_, N> {
    node.lock().unwrap_or_else(PoisonError::into_inner)
}

impl<N: Node> Node for Arc<Mutex<N>> {
    fn baud(&self) -> u32 {
        lock(self).baud()
    }

    fn hear(&mut self, heard: Heard) {
        lock(self).hear(heard);
    }

    fn next_event(&self) -> Option<Ns> {
        lock(self).next_event()
    }

    fn act(&mut self, now: Ns) -> Option<Burst> {
        lock(self).act(now)
    }

    fn deaf_while_sending(&self) -> bool {
        lock(self).deaf_while_sending()
    }

    fn power_off(&mut self, now: Ns) {
        lock(self).power_off(now);
    }

    fn power_on(&mut self, now: Ns) {
        lock(self).power_on(now);
    }

    fn line_level(&mut self, now: Ns, high: bool) {
        lock(self).line_level(now, high);
    }
}
