//! What the number of a node means, and what is kept of it when that changes.
//!
//! A sensor that is zeroed, reversed, moved or reset says other numbers from some instant on, and so does a bus at
//! another bit rate. What was kept of the numbers before (filter, turns, rate, confirmation, refresh) is worth nothing
//! then, in every slot that reads the node: several may read the axes of one T7, and a PWM input is the other output of
//! the ISU that its partner reads. [`readers`] finds them, [`Polled::restart`] forgets.
//!
//! When exactly a node begins to say its new numbers is not known: the write may be lost, its answer may be lost, an
//! ISU says its last angle until the next refresh. So from the request that may change it, until the task that has sent
//! it has ended and the node has had time (`PollRules::settles`), the node's numbers are not used ([`Settling`]).
//!
//! ```text
//!   task   ──── write ─ answer, or none ───── read back ── end
//!   slot   ok ─┤ restart: never_read, whatever the node says                 ├─ first value, confirmed ── ok
//!                                                   end, and SETTLES after the last write
//! ```
//!
//! Limit: a change that nothing on the bus shows (another tool, a magnet) is not noticed; a T7 that is asked for
//! everything says its serial number, and another one is another sensor.

use clino_bus::Instant;

use super::Polled;
use crate::bits::Bits;
use crate::{Bus, Source};

/// Nodes of one bus, a bit each by address; no protocol has more than 128.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Nodes(u128);

/// The T7 address at which all respond (T7 guide section 1.4), and the ISU's (AN #201 section 4).
const ALL_T7: u8 = 126;
const ALL_ISU: u8 = 0;

impl Nodes {
    /// No node.
    pub const NONE: Nodes = Nodes(0);
    /// Every node.
    pub const ALL: Nodes = Nodes(u128::MAX);

    /// The nodes that listen to this address.
    #[inline(never)]
    pub const fn at(bus: Bus, address: u8) -> Nodes {
        match (bus, address) {
            (Bus::T7, ALL_T7) | (Bus::Isu, ALL_ISU) => Nodes::ALL,
            _ => Nodes(1_u128.wrapping_shl(address as u32)),
        }
    }

    /// Whether both have one in common.
    pub const fn meet(self, other: Nodes) -> bool {
        self.0 & other.0 != 0
    }

    /// Those of both.
    #[must_use]
    pub const fn and(self, other: Nodes) -> Nodes {
        Nodes(self.0 | other.0)
    }
}

/// The slots whose numbers come from these nodes: those that read them, and the PWM inputs whose partner does.
#[inline(never)]
pub(crate) fn readers(slots: &[Polled], bus: Bus, nodes: Nodes) -> Bits {
    let reads = |source: &Source| {
        source.node().is_some_and(|(on, address)| on == bus && Nodes::at(on, address).meet(nodes))
    };
    let mut readers = Bits::EMPTY;
    for (index, Polled { slot, .. }) in slots.iter().enumerate() {
        let source = match (slot.config.source, slot.config.partner) {
            (Source::Pwm { .. }, Some(partner)) => {
                slots.get(usize::from(partner)).map(|polled| polled.slot.config.source)
            }
            (source, _) => Some(source),
        };
        readers.set(index, source.is_some_and(|source| reads(&source)));
    }
    readers
}

/// Nodes of one bus whose numbers are not used yet.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Settling {
    nodes: Nodes,
    /// They answer all requests after this with their new numbers,
    until: Instant,
    /// and after the end of the task.
    task: bool,
    /// The exchange under way is one that may change them.
    under_way: bool,
}

impl Settling {
    /// A request that may change these nodes goes out for a task.
    pub fn begin(&mut self, nodes: Nodes, now: Instant) {
        self.add(nodes, now, now);
        (self.task, self.under_way) = (true, true);
    }

    /// Answers of these nodes to requests before `until` are not used.
    pub fn add(&mut self, nodes: Nodes, until: Instant, now: Instant) {
        if !self.task && now >= self.until {
            self.nodes = Nodes::NONE;
        }
        (self.nodes, self.until) = (self.nodes.and(nodes), self.until.max(until));
    }

    /// An exchange of the task has ended, answered or not. If it may have changed its nodes, they have done so by
    /// `until`.
    pub fn sent(&mut self, until: Instant) {
        if core::mem::take(&mut self.under_way) {
            self.until = self.until.max(until);
        }
    }

    /// The task has ended.
    pub fn end(&mut self) {
        self.task = false;
    }

    /// Whether answers of these nodes to a request of `asked` are not used.
    pub fn holds(&self, nodes: Nodes, asked: Instant) -> bool {
        (self.task || asked < self.until) && self.nodes.meet(nodes)
    }
}

#[cfg(test)]
mod tests;
