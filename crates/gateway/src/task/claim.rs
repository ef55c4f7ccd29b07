//! What a task works on besides its sensor.
//!
//! Two orders about one thing have an order: what was acknowledged last is in force in the end. A task takes a while,
//! so that a change that comes meanwhile would be overwritten by its end. Such a change is refused as busy, and no
//! other.

use clino_codec::angle::Angle;

use crate::config::{Bus, SlotConfig, Source};

/// What no other order may change until the task has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Claim {
    /// Nothing but the bit rate, at which every task runs.
    Nothing,
    /// The bit rate of its bus, at whatever value.
    BitRate,
    /// Which slots read one of two addresses: a sensor moves from the first to the second, and its slots follow.
    Addresses(Bus, [u8; 2]),
    /// The soft zeros of the slots that read this: it will read zero as it stands.
    Zero(Source),
}

impl Claim {
    /// Whether a slot may be changed.
    pub fn allows(self, from: &SlotConfig, to: &SlotConfig) -> bool {
        let moves = from.source != to.source;
        match self {
            Claim::Nothing | Claim::BitRate => true,
            Claim::Addresses(bus, nodes) => {
                let is_claimed =
                    |source: &Source| nodes.iter().any(|&node| source.node() == Some((bus, node)));
                !moves || !is_claimed(&to.source)
            }
            Claim::Zero(source) => {
                let keeps = !moves && from.soft_zero == to.soft_zero;
                to.source != source || to.soft_zero == Angle::ZERO || keeps
            }
        }
    }
}
