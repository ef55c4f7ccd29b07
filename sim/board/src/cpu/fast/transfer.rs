//! The instructions that read or write memory: single, dual and multiple loads and stores, and branches by a table.

use rsemu::core::value::Width;

use super::memory::Memory;
use super::op::{self, Kind, Op, PC};
use super::state::{Cycles, Refused, State, go, interworking};

impl State {
    pub fn table_branch(&mut self, op: Op, memory: &Memory, next: &mut u32) -> Cycles {
        let index = self.get(op.m());
        let (address, width) = match op.kind {
            Kind::TableOfHalves => (self.get(op.n()).wrapping_add(index.wrapping_mul(2)), Width::U16),
            _ => (self.get(op.n()).wrapping_add(index), Width::U8),
        };
        if !is_aligned(address, width) {
            return Err(Refused);
        }
        let distance = read(memory, address, width)?.wrapping_mul(2);
        Ok(1 + go(next, self.r[15].wrapping_add(distance) & !1))
    }

    /// The address of an access with a constant offset, and what N may become.
    #[inline(always)]
    pub fn address(&self, op: Op) -> (u32, u32) {
        let base = self.get(op.n());
        let moved = base.wrapping_add(op.value);
        (if op.has(op::AFTER) { base } else { moved }, moved)
    }

    #[inline(always)]
    pub fn write_back(&mut self, op: Op, moved: u32) {
        if op.has(op::BACK) {
            self.set(op.n(), moved);
        }
    }

    #[inline(always)]
    pub fn load(&mut self, op: Op, memory: &Memory, width: Width, extend: impl Fn(u32) -> u32) -> Cycles {
        let (address, moved) = self.address(op);
        let value = extend(read(memory, address, width)?);
        self.write_back(op, moved);
        self.set(op.d(), value);
        Ok(2)
    }

    #[inline(always)]
    pub fn store(&mut self, op: Op, memory: &Memory, width: Width) -> Cycles {
        let (address, moved) = self.address(op);
        write(memory, address, width, self.get(op.d()))?;
        self.write_back(op, moved);
        Ok(2)
    }

    #[inline(always)]
    pub fn load_at(&mut self, op: Op, memory: &Memory, width: Width, extend: impl Fn(u32) -> u32) -> Cycles {
        let address = self.get(op.n()).wrapping_add(self.get(op.m()) << op.value);
        let value = extend(read(memory, address, width)?);
        self.set(op.d(), value);
        Ok(2)
    }

    #[inline(always)]
    pub fn store_at(&mut self, op: Op, memory: &Memory, width: Width) -> Cycles {
        let address = self.get(op.n()).wrapping_add(self.get(op.m()) << op.value);
        write(memory, address, width, self.get(op.d()))?;
        Ok(2)
    }

    pub fn dual(&mut self, op: Op, memory: &Memory) -> Cycles {
        let (address, moved) = self.address(op);
        let load = op.kind == Kind::LoadDual;
        if !is_aligned(address, Width::U32) || !memory.has(address, 8, !load) {
            return Err(Refused);
        }
        let second = address.wrapping_add(4);
        if load {
            let values = (read(memory, address, Width::U32)?, read(memory, second, Width::U32)?);
            self.set(op.d(), values.0);
            self.set(op.a(), values.1);
        } else {
            write(memory, address, Width::U32, self.get(op.d()))?;
            write(memory, second, Width::U32, self.get(op.a()))?;
        }
        self.write_back(op, moved);
        Ok(3)
    }

    pub fn multiple(&mut self, op: Op, memory: &Memory, next: &mut u32) -> Cycles {
        let load = op.kind == Kind::LoadMultiple;
        let base = self.get(op.n());
        let count = op.value.count_ones();
        let (start, moved) = match op.has(op::AFTER) {
            true => (base, base.wrapping_add(4 * count)),
            false => (base.wrapping_sub(4 * count), base.wrapping_sub(4 * count)),
        };
        if !is_aligned(start, Width::U32) || !memory.has(start, 4 * count, !load) {
            return Err(Refused);
        }
        let target = if load && op.value >> PC != 0 {
            let last = start.wrapping_add(4 * (count - 1));
            Some(interworking(read(memory, last, Width::U32)?)?)
        } else {
            None
        };
        if load {
            self.write_back(op, moved);
        }
        let (mut address, mut left) = (start, op.value);
        while left != 0 {
            let register = left.trailing_zeros() as u8;
            left &= left - 1;
            if load {
                let value = read(memory, address, Width::U32)?;
                self.set(register, value);
            } else {
                write(memory, address, Width::U32, self.get(register))?;
            }
            address = address.wrapping_add(4);
        }
        if !load {
            self.write_back(op, moved);
        }
        Ok(u64::from(count) + target.map_or(1, |target| go(next, target)))
    }
}

#[inline]
fn is_aligned(address: u32, width: Width) -> bool {
    address & (width.bytes() as u32 - 1) == 0
}

/// A read of memory, if all of it is in one.
#[inline(always)]
pub fn read(memory: &Memory, address: u32, width: Width) -> Result<u32, Refused> {
    if !is_aligned(address, width) {
        return read_unaligned(memory, address, width);
    }
    memory.read(address, width).ok_or(Refused)
}

#[cold]
fn read_unaligned(memory: &Memory, address: u32, width: Width) -> Result<u32, Refused> {
    let byte = |at: u64| Some(memory.read(address.wrapping_add(at as u32), Width::U8)? << (8 * at));
    (0..width.bytes()).map(byte).try_fold(0, |value, byte| Some(value | byte?)).ok_or(Refused)
}

/// A write to RAM, if all of it is in one.
#[inline(always)]
fn write(memory: &Memory, address: u32, width: Width, value: u32) -> Result<(), Refused> {
    if !is_aligned(address, width) {
        return write_unaligned(memory, address, width, value);
    }
    if memory.write(address, width, value) { Ok(()) } else { Err(Refused) }
}

#[cold]
fn write_unaligned(memory: &Memory, address: u32, width: Width, value: u32) -> Result<(), Refused> {
    if !memory.has(address, width.bytes() as u32, true) {
        return Err(Refused);
    }
    let byte = |at: u64| memory.write(address.wrapping_add(at as u32), Width::U8, value >> (8 * at) & 0xff);
    if (0..width.bytes()).all(byte) { Ok(()) } else { Err(Refused) }
}
