//! What an instruction does to registers, flags and memory (ARM DDI 0403 A7.7), and how many cycles the emulator charges
//! for it: one, one more for each access to memory, two more for a branch that is taken.
//!
//! An instruction either is done here as a whole, or nothing of it is and the emulator has to.

use rsemu::core::value::Width;
use rsemu::cpu::arm::v7m::isa::{BitfieldOp, Cond, ExtendOp, HintOp, Insn, MemOffset, MiscOp, Operand, Size};
use rsemu::cpu::arm::v7m::xpsr;

use super::alu;
use super::code::Decoded;
use super::memory::Memory;

/// Program counter, link register and stack pointer.
const PC: u8 = 15;
const LR: usize = 14;
/// The upper sixteenth of the address space: a branch there is an exception return.
const MAGIC: u32 = 0xf000_0000;

/// Numbers of special registers in MRS and MSR (ARM DDI 0403 table B5-1).
const PRIMASK: u8 = 16;
const BASEPRI: u8 = 17;
const BASEPRI_MAX: u8 = 18;

/// The registers that instructions of a level work on.
pub struct State {
    /// R0 to R15; R15 is the address of the next instruction.
    pub r: [u32; 16],
    pub xpsr: u32,
    /// The masks.
    pub primask: bool,
    pub basepri: u8,
    /// No enabled exception is pending: whatever the masks are, none is entered.
    pub is_undisturbed: bool,
}

/// Not for here.
pub struct Refused;

type Cycles = Result<u64, Refused>;

impl State {
    /// Executes `decoded`, which is at R15; returns the cycles.
    #[inline]
    pub fn execute(&mut self, decoded: &Decoded, memory: &Memory) -> Cycles {
        let Decoded { instruction, is_wide } = decoded;
        let here = self.r[15];
        let in_block = self.xpsr & xpsr::IT_MASK != 0;
        if in_block && matches!(instruction, Insn::It { .. }) {
            return Err(Refused);
        }
        let holds = !in_block || Cond(self.it_state() >> 4).passes(self.xpsr);
        // It reads as four bytes ahead; what is left of it that way was not branched.
        self.r[15] = here.wrapping_add(4);
        let mut next = here.wrapping_add(if *is_wide { 4 } else { 2 });
        let done = if holds {
            // Instructions of two bytes leave the flags alone in an IT block.
            self.perform(instruction, in_block && !is_wide, here, memory, &mut next)
        } else {
            Ok(1)
        };
        self.r[15] = if done.is_ok() { next } else { here };
        if done.is_ok() && in_block {
            self.advance_block();
        }
        done
    }

    #[inline]
    fn perform(
        &mut self,
        instruction: &Insn,
        quiet: bool,
        here: u32,
        memory: &Memory,
        next: &mut u32,
    ) -> Cycles {
        match *instruction {
            Insn::DataProc { op, s, rd, rn, operand } => {
                let carry = self.has(xpsr::C);
                let (b, shifted) = match operand {
                    Operand::Imm { value, carry: of_value } => (value, of_value.unwrap_or(carry)),
                    Operand::Reg { rm, shift } => alu::shift_by(shift, self.get(rm), carry),
                };
                let a = if op.is_unary() { 0 } else { self.get(rn) };
                let (result, c, v) = alu::data_processing(op, a, b, carry, shifted, self.has(xpsr::V));
                let mut cycles = 1;
                if !op.is_test() {
                    if rd == PC {
                        *next = result & !1;
                        cycles = 3;
                    } else {
                        self.set(rd, result);
                    }
                }
                if s && (!quiet || op.is_test()) {
                    self.set_nz(result);
                    self.flag(xpsr::C, c);
                    self.flag(xpsr::V, v);
                }
                Ok(cycles)
            }
            Insn::ShiftReg { ty, s, rd, rn, rm } => {
                let amount = self.get(rm) & 0xff;
                let (result, carry) = alu::shift_by_register(ty, self.get(rn), amount, self.has(xpsr::C));
                self.set(rd, result);
                if s && !quiet {
                    self.set_nz(result);
                    self.flag(xpsr::C, carry);
                }
                Ok(1)
            }
            Insn::Adr { rd, imm, add } => {
                self.set(rd, offset(self.r[15] & !3, imm, add));
                Ok(1)
            }
            Insn::MovImm16 { top, rd, imm } => {
                let value = if top { self.get(rd) & 0xffff | u32::from(imm) << 16 } else { u32::from(imm) };
                self.set(rd, value);
                Ok(1)
            }
            Insn::Branch { cond, offset } => {
                if cond.is_some_and(|cond| !cond.passes(self.xpsr)) {
                    return Ok(1);
                }
                *next = self.r[15].wrapping_add(offset as u32) & !1;
                Ok(3)
            }
            Insn::BranchLink { offset } => {
                self.r[LR] = here.wrapping_add(4) | 1;
                *next = self.r[15].wrapping_add(offset as u32) & !1;
                Ok(3)
            }
            Insn::Bx { rm } => {
                *next = self.interworking(self.get(rm))?;
                Ok(3)
            }
            Insn::Blx { rm } => {
                // By way of LR, a branch goes to where the instruction returns to.
                let link = here.wrapping_add(2) | 1;
                *next = self.interworking(self.get(rm))?;
                self.r[LR] = link;
                Ok(3)
            }
            Insn::Cbz { nonzero, rn, offset } => {
                if (self.get(rn) != 0) != nonzero {
                    return Ok(1);
                }
                *next = self.r[15].wrapping_add(offset) & !1;
                Ok(3)
            }
            Insn::TableBranch { rn, rm, half } => {
                let (scale, width) = if half { (2, Width::U16) } else { (1, Width::U8) };
                let entry = self.get(rn).wrapping_add(self.get(rm).wrapping_mul(scale));
                if half && entry & 1 != 0 {
                    return Err(Refused);
                }
                let distance = read(memory, entry, width)?;
                *next = self.r[15].wrapping_add(distance.wrapping_mul(2)) & !1;
                Ok(4)
            }
            Insn::It { cond, mask } => {
                self.set_it_state(cond.0 << 4 | mask);
                Ok(1)
            }
            Insn::LoadStore { load, size, signed, rt, rn, offset: by, index, add, wback, unpriv } => {
                if unpriv {
                    return Err(Refused);
                }
                let base = self.get(rn);
                let by = match by {
                    MemOffset::Imm(value) => value,
                    MemOffset::Reg { rm, lsl } => self.get(rm) << lsl,
                };
                let moved = offset(base, by, add);
                let address = if index { moved } else { base };
                if load {
                    let value = extended(read(memory, address, width(size))?, size, signed);
                    let target = if rt == PC { Some(self.interworking(value)?) } else { None };
                    if wback {
                        self.set(rn, moved);
                    }
                    if let Some(target) = target {
                        *next = target;
                        return Ok(4);
                    }
                    self.set(rt, value);
                } else {
                    write(memory, address, width(size), self.get(rt))?;
                    if wback {
                        self.set(rn, moved);
                    }
                }
                Ok(2)
            }
            Insn::LoadLiteral { size, signed, rt, imm, add } => {
                let address = offset(self.r[15] & !3, imm, add);
                let value = extended(read(memory, address, width(size))?, size, signed);
                if rt == PC {
                    *next = self.interworking(value)?;
                    return Ok(4);
                }
                self.set(rt, value);
                Ok(2)
            }
            Insn::LoadStoreDual { load, rt, rt2, rn, imm, index, add, wback } => {
                let base = if rn == PC { self.r[15] & !3 } else { self.get(rn) };
                let moved = offset(base, imm, add);
                let address = if index { moved } else { base };
                if !address.is_multiple_of(4) || !memory.has(address, 8, !load) {
                    return Err(Refused);
                }
                if load {
                    let first = read(memory, address, Width::U32)?;
                    let second = read(memory, address.wrapping_add(4), Width::U32)?;
                    self.set(rt, first);
                    self.set(rt2, second);
                } else {
                    write(memory, address, Width::U32, self.get(rt))?;
                    write(memory, address.wrapping_add(4), Width::U32, self.get(rt2))?;
                }
                if wback {
                    self.set(rn, moved);
                }
                Ok(3)
            }
            Insn::LoadStoreMultiple { load, rn, list, wback, before } => {
                self.block_transfer(load, rn, list, wback, before, memory, next)
            }
            Insn::Mul { rd, rn, rm, ra, sub, s } => {
                let product = self.get(rn).wrapping_mul(self.get(rm));
                let result = match ra {
                    None => product,
                    Some(ra) if sub => self.get(ra).wrapping_sub(product),
                    Some(ra) => self.get(ra).wrapping_add(product),
                };
                self.set(rd, result);
                if s && !quiet {
                    self.set_nz(result);
                }
                Ok(1)
            }
            Insn::MulLong { signed, accumulate, rdlo, rdhi, rn, rm, umaal: false } => {
                let (a, b) = (self.get(rn), self.get(rm));
                let sum = u64::from(self.get(rdhi)) << 32 | u64::from(self.get(rdlo));
                let product = if signed {
                    (i64::from(a as i32) * i64::from(b as i32)) as u64
                } else {
                    u64::from(a) * u64::from(b)
                };
                let result = if accumulate { product.wrapping_add(sum) } else { product };
                self.set(rdlo, result as u32);
                self.set(rdhi, (result >> 32) as u32);
                Ok(2)
            }
            Insn::Div { signed, rd, rn, rm } => {
                let (a, b) = (self.get(rn), self.get(rm));
                let result = match (b, signed) {
                    // A fault, if firmware wants one.
                    (0, _) => return Err(Refused),
                    (_, true) => (a as i32).wrapping_div(b as i32) as u32,
                    (_, false) => a / b,
                };
                self.set(rd, result);
                Ok(3)
            }
            Insn::Extend { op, rd, rn, rm, rotate } => {
                let rotated = self.get(rm).rotate_right(u32::from(rotate));
                let value = match op {
                    ExtendOp::Sxtb => rotated as u8 as i8 as u32,
                    ExtendOp::Sxth => rotated as u16 as i16 as u32,
                    ExtendOp::Uxtb => rotated & 0xff,
                    ExtendOp::Uxth => rotated & 0xffff,
                    _ => return Err(Refused),
                };
                self.set(rd, if rn == PC { value } else { self.get(rn).wrapping_add(value) });
                Ok(1)
            }
            Insn::Misc { op, rd, rm } => {
                let value = self.get(rm);
                let result = match op {
                    MiscOp::Clz => value.leading_zeros(),
                    MiscOp::Rbit => value.reverse_bits(),
                    MiscOp::Rev => value.swap_bytes(),
                    MiscOp::Rev16 => value.swap_bytes().rotate_left(16),
                    MiscOp::Revsh => (value as u16).swap_bytes() as i16 as u32,
                };
                self.set(rd, result);
                Ok(1)
            }
            Insn::Bitfield { op, rd, rn, lsb, width } => {
                let unused = 32 - u32::from(width).clamp(1, 32);
                let lsb = u32::from(lsb) & 31;
                let mask = u32::MAX >> unused;
                let field = self.get(rn) >> lsb & mask;
                let hole = self.get(rd) & !(mask << lsb);
                let result = match op {
                    BitfieldOp::Ubfx => field,
                    BitfieldOp::Sbfx => ((field << unused) as i32 >> unused) as u32,
                    BitfieldOp::Bfi => hole | (self.get(rn) & mask) << lsb,
                    BitfieldOp::Bfc => hole,
                };
                self.set(rd, result);
                Ok(1)
            }
            Insn::Mrs { rd, sysm: PRIMASK } => {
                self.set(rd, u32::from(self.primask));
                Ok(1)
            }
            Insn::Mrs { rd, sysm: BASEPRI | BASEPRI_MAX } => {
                self.set(rd, u32::from(self.basepri));
                Ok(1)
            }
            Insn::Msr { rn, sysm, .. } if self.is_undisturbed => {
                let value = self.get(rn);
                match sysm {
                    PRIMASK => self.primask = value & 1 != 0,
                    BASEPRI => self.basepri = value as u8,
                    // Only ever masks more.
                    BASEPRI_MAX if value as u8 != 0 && (self.basepri == 0 || (value as u8) < self.basepri) => {
                        self.basepri = value as u8;
                    }
                    BASEPRI_MAX => {}
                    _ => return Err(Refused),
                }
                Ok(1)
            }
            Insn::Cps { enable, i, f: false } if self.is_undisturbed => {
                if i {
                    self.primask = !enable;
                }
                Ok(1)
            }
            // Accesses are in order as they are.
            Insn::Barrier { .. } | Insn::Hint { op: HintOp::Nop } => Ok(1),
            _ => Err(Refused),
        }
    }

    #[expect(clippy::too_many_arguments, reason = "the encoding has that many fields")]
    fn block_transfer(
        &mut self,
        load: bool,
        rn: u8,
        list: u16,
        wback: bool,
        before: bool,
        memory: &Memory,
        next: &mut u32,
    ) -> Cycles {
        let base = self.get(rn);
        let span = 4 * list.count_ones();
        let moved = offset(base, span, !before);
        let start = if before { moved } else { base };
        if list == 0 || !start.is_multiple_of(4) || !memory.has(start, span, !load) {
            return Err(Refused);
        }
        let target = if load && list >> PC != 0 {
            let last = read(memory, start.wrapping_add(span - 4), Width::U32)?;
            Some(self.interworking(last)?)
        } else {
            None
        };
        if load && wback {
            self.set(rn, moved);
        }
        let mut address = start;
        let mut left = list;
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
        if !load && wback {
            self.set(rn, moved);
        }
        let accesses = u64::from(list.count_ones());
        Ok(match target {
            Some(target) => {
                *next = target;
                3 + accesses
            }
            None => 1 + accesses,
        })
    }

    /// Where a branch to `target` goes, unless it is a fault or an exception return.
    #[inline]
    fn interworking(&self, target: u32) -> Result<u32, Refused> {
        if target & 1 == 0 || target & MAGIC == MAGIC { Err(Refused) } else { Ok(target & !1) }
    }

    #[inline]
    fn get(&self, register: u8) -> u32 {
        self.r[usize::from(register & 15)]
    }

    /// A branch is another thing: nothing else writes to R15.
    #[inline]
    fn set(&mut self, register: u8, value: u32) {
        if register != PC {
            self.r[usize::from(register & 15)] = value;
        }
    }

    #[inline]
    fn has(&self, flag: u32) -> bool {
        self.xpsr & flag != 0
    }

    #[inline]
    fn flag(&mut self, flag: u32, on: bool) {
        self.xpsr = self.xpsr & !flag | if on { flag } else { 0 };
    }

    #[inline]
    fn set_nz(&mut self, result: u32) {
        self.flag(xpsr::N, result >> 31 != 0);
        self.flag(xpsr::Z, result == 0);
    }

    /// ITSTATE: its upper six bits are bits 15 to 10, its lower two bits 26 and 25.
    #[inline]
    fn it_state(&self) -> u8 {
        ((self.xpsr >> 10 & 0x3f) << 2 | self.xpsr >> 25 & 3) as u8
    }

    #[inline]
    fn set_it_state(&mut self, state: u8) {
        let state = u32::from(state);
        self.xpsr = self.xpsr & !xpsr::IT_MASK | (state >> 2) << 10 | (state & 3) << 25;
    }

    /// To the next instruction of an IT block (ARM DDI 0403 A7.3.2).
    fn advance_block(&mut self) {
        let state = self.it_state();
        self.set_it_state(if state & 7 == 0 { 0 } else { state & 0xe0 | state << 1 & 0x1f });
    }
}

#[inline]
fn offset(base: u32, by: u32, add: bool) -> u32 {
    if add { base.wrapping_add(by) } else { base.wrapping_sub(by) }
}

#[inline]
fn width(size: Size) -> Width {
    match size {
        Size::Byte => Width::U8,
        Size::Half => Width::U16,
        Size::Word => Width::U32,
    }
}

#[inline]
fn extended(value: u32, size: Size, signed: bool) -> u32 {
    match (size, signed) {
        (Size::Byte, true) => value as u8 as i8 as u32,
        (Size::Half, true) => value as u16 as i16 as u32,
        _ => value,
    }
}

/// A read of memory, if all of it is in one.
#[inline]
fn read(memory: &Memory, address: u32, width: Width) -> Result<u32, Refused> {
    if address & (width.bytes() as u32 - 1) != 0 {
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
#[inline]
fn write(memory: &Memory, address: u32, width: Width, value: u32) -> Result<(), Refused> {
    if address & (width.bytes() as u32 - 1) != 0 {
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
