//! What is made of a sensor's angles. Integers only; no angle is far from another across the seam of the turn.
//!
//! ```text
//! raw ── soft zero, direction ── filter ── output range ── angle
//!                                              │
//!                                              └── rate, turns
//! ```

use clino_codec::angle::Angle;

use crate::config::Direction;

mod filter;
mod motion;

pub(crate) use filter::{MOST_SAMPLES, Window};
pub(crate) use motion::Motion;

/// The sensor's angle as the slot counts it: from its soft zero, in its direction; −180° up to, not including, 180°.
pub(crate) fn oriented(raw: Angle, soft_zero: Angle, direction: Direction) -> Angle {
    match direction {
        Direction::Normal => raw.difference(soft_zero),
        Direction::Reversed => soft_zero.difference(raw),
    }
}

#[cfg(test)]
mod tests;
