//! The instructions in flash, each decoded once.

use rsemu::cpu::arm::v7m::isa::{decode, is_32bit};

use super::memory::Memory;
use super::op::{Kind, Op};

/// Halfwords of a page.
const PAGE: usize = 2048;

/// Instructions decoded so far, by page and halfword.
#[derive(Default)]
pub struct Code {
    start: u32,
    pages: Vec<Option<Box<[Op; PAGE]>>>,
}

impl Code {
    /// Of the flash of `memory`, with nothing decoded yet.
    pub fn of(memory: &Memory) -> Code {
        let (start, length) = memory.flash();
        let pages = (length as usize / 2).div_ceil(PAGE);
        Code { start, pages: (0..pages).map(|_| None).collect() }
    }

    /// The instruction at `address`, if that is in flash.
    #[inline(always)]
    pub fn at(&mut self, address: u32, memory: &Memory) -> Option<Op> {
        let index = self.index(address);
        let known = self.pages.get(index / PAGE)?.as_ref().map_or(Op::UNKNOWN, |page| page[index % PAGE]);
        if known.kind == Kind::Unknown { self.learn(address, memory) } else { Some(known) }
    }

    #[cold]
    fn learn(&mut self, address: u32, memory: &Memory) -> Option<Op> {
        let index = self.index(address);
        let (first, second) = memory.code(address)?;
        let op = Op::of(decode(first, second), is_32bit(first), address);
        let page = self.pages.get_mut(index / PAGE)?;
        page.get_or_insert_with(|| Box::new([Op::UNKNOWN; PAGE]))[index % PAGE] = op;
        Some(op)
    }

    #[inline]
    fn index(&self, address: u32) -> usize {
        address.wrapping_sub(self.start) as usize / 2
    }
}
