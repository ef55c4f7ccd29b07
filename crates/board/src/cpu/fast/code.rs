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

/// What has been decoded so far, by page; instructions begin at halfwords.
#[derive(Default)]
pub struct Code {
    start: u32,
    pages: Vec<Option<Box<[Option<Decoded>; PAGE]>>>,
}

impl Code {
    /// Nothing is decoded yet of the flash of `memory`.
    pub fn of(memory: &Memory) -> Code {
        let (start, length) = memory.flash();
        let pages = (length as usize / 2).div_ceil(PAGE);
        Code { start, pages: (0..pages).map(|_| None).collect() }
    }

    /// The instruction at `address`, if that was decoded.
    #[inline]
    pub fn known(&self, address: u32) -> Option<&Decoded> {
        let index = self.index(address);
        self.pages.get(index / PAGE)?.as_ref()?[index % PAGE].as_ref()
    }

    /// Decodes the instruction at `address`; returns whether there is one in flash.
    #[cold]
    pub fn learn(&mut self, address: u32, memory: &Memory) -> bool {
        let index = self.index(address);
        let (Some((first, second)), Some(page)) = (memory.code(address), self.pages.get_mut(index / PAGE)) else {
            return false;
        };
        let page = page.get_or_insert_with(|| Box::new([None; PAGE]));
        page[index % PAGE] = Some(Decoded { instruction: decode(first, second), is_wide: is_32bit(first) });
        true
    }

    #[inline]
    fn index(&self, address: u32) -> usize {
        address.wrapping_sub(self.start) as usize / 2
    }
}
