//! A set of slots, one bit each.

use crate::config::MAX_SLOTS;

const _: () = assert!(MAX_SLOTS <= u64::BITS as usize);

/// A set of slots.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Bits(u64);

impl Bits {
    /// No slot.
    pub const EMPTY: Bits = Bits(0);

    /// Puts a slot in, or takes it out.
    #[inline(never)]
    pub fn set(&mut self, slot: usize, on: bool) {
        self.0 = if on { self.0 | Bits::bit(slot) } else { self.0 & !Bits::bit(slot) };
    }

    /// Whether there is none.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether the slot is in it.
    #[inline(never)]
    pub fn has(self, slot: usize) -> bool {
        self.0 & Bits::bit(slot) != 0
    }

    /// Those in either.
    pub fn or(self, other: Bits) -> Bits {
        Bits(self.0 | other.0)
    }

    /// Those that are not in the other.
    pub fn without(self, other: Bits) -> Bits {
        Bits(self.0 & !other.0)
    }

    /// The numbers of the slots, lowest first.
    pub fn iter(mut self) -> impl Iterator<Item = usize> {
        core::iter::from_fn(move || self.pop())
    }

    /// Takes the lowest out.
    #[inline(never)]
    fn pop(&mut self) -> Option<usize> {
        let lowest = self.0.trailing_zeros();
        self.0 &= self.0.wrapping_sub(1);
        (lowest < u64::BITS).then_some(lowest as usize)
    }

    fn bit(slot: usize) -> u64 {
        u32::try_from(slot).ok().and_then(|slot| 1_u64.checked_shl(slot)).unwrap_or(0)
    }
}
