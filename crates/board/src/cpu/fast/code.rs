//! The instructions in flash, each decoded once.

use rsemu::cpu::arm::v7m::isa::{Insn, decode, is_32bit};

use super::memory::Memory;

/// Halfwords of a page.
const PAGE: usize = 2048;

/// A decoded instruction.
#[derive(Clone, Copy)]
pub struct Decoded {
    pub instruction: Insn,
    /// Of four bytes, not two.
    pub is_wide: bool,
}

/// What has been decoded so far, by page.
#[derive(Default)]
pub struct Code {
    start: u32,
    pages: Vec<Option<Box<[Option<Decoded>]>>>,
}

impl Code {
    /// Nothing is decoded yet of the flash of `memory`.
    pub fn of(memory: &Memory) -> Code {
        let (start, length) = memory.flash();
        let pages = (length as usize / 2).div_ceil(PAGE);
        Code { start, pages: (0..pages).map(|_| None).collect() }
    }

    /// The instruction at `address`, if that is in flash.
    #[inline]
    pub fn at(&mut self, address: u32, memory: &Memory) -> Option<Decoded> {
        let index = address.wrapping_sub(self.start) as usize / 2;
        let page = self.pages.get_mut(index / PAGE)?;
        if let Some(Some(decoded)) = page.as_ref().and_then(|page| page.get(index % PAGE)) {
            return Some(*decoded);
        }
        let (first, second) = memory.code(address)?;
        let decoded = Decoded { instruction: decode(first, second), is_wide: is_32bit(first) };
        let page = page.get_or_insert_with(|| vec![None; PAGE].into_boxed_slice());
        if let Some(place) = page.get_mut(index % PAGE) {
            *place = Some(decoded);
        }
        Some(decoded)
    }
}
