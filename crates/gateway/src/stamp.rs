//! An instant in half the room of [`Micros`]: 48 slots keep several each.
//!
//! It holds the low half of an instant, so that it can be told from others within half an hour only. Whoever keeps one
//! has to forget it when nothing has happened for longer.

use clino_bus::Micros;

/// The low half of an instant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Stamp(u32);

impl Stamp {
    pub const fn of(at: Micros) -> Stamp {
        Stamp(at.0 as u32)
    }

    /// The instant itself, next to one that is less than half an hour away.
    pub const fn near(self, now: Micros) -> Micros {
        let ahead = self.0.wrapping_sub(now.0 as u32).cast_signed();
        Micros(now.0.saturating_add_signed(ahead as i64))
    }
}
