//! From a sensor's angle to the published one. Integers only; no angle is far from another across the seam of the turn.
//!
//! ```text
//! raw ── soft zero, direction ── filter ─┬─ publication (value/publication.rs) ── angle
//!                                        │
//!                                        └─ rate, turns
//! ```

use clino_codec::angle::Angle;

use crate::config::Direction;

/// The turn from one angle to another, the shorter way: −180° up to, not including, 180°, in µ°.
#[inline(never)]
pub(crate) fn step(from: Angle, to: Angle) -> i32 {
    to.difference(from).udeg()
}

/// The sensor's angle as the slot counts it: from its soft zero, in its direction; −180° up to, not including, 180°.
pub(crate) fn oriented(raw: Angle, soft_zero: Angle, direction: Direction) -> Angle {
    Angle::from_udeg(match direction {
        Direction::Normal => step(soft_zero, raw),
        Direction::Reversed => step(raw, soft_zero),
    })
}

#[cfg(test)]
mod tests;
