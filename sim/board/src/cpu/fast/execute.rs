//! Executes one instruction on registers, flags and memory (ARM DDI 0403 A7.7), and counts its cycles as the emulator does:
//! one, one more for each access to memory and for a long multiplication, two more for a taken branch and for a division.
//!
//! An instruction is either executed as a whole, or refused without any effect; the emulator executes it then.
//!
//! What is marked `inline(always)` belongs into one loop: left to the compiler, a run takes a fifth more host instructions.

use rsemu::core::value::Width;
use rsemu::cpu::arm::v7m::isa::DpOp;
use rsemu::cpu::arm::v7m::xpsr;

use super::alu;
use super::memory::Memory;
use super::op::{self, Kind, Op, PC};
use super::state::{Cycles, Refused, State, go, interworking};
use super::transfer::read;

/// Link register.
const LR: usize = 14;

impl State {
    /// Executes `op`, which is at R15; returns the cycles.
    #[inline(always)]
    pub fn execute(&mut self, op: Op, memory: &Memory) -> Cycles {
        let here = self.r[15];
        let mut next = here.wrapping_add(if op.has(op::WIDE) { 4 } else { 2 });
        // It reads as four bytes ahead.
        self.r[15] = here.wrapping_add(4);
        let in_block = self.has(xpsr::IT_MASK);
        let done = if in_block && op.kind == Kind::It {
            Err(Refused)
        } else if !in_block || self.holds(self.it_state() >> 4) {
            // Instructions of two bytes leave the flags alone in a block.
            self.perform(op, in_block && !op.has(op::WIDE), here, memory, &mut next)
        } else {
            Ok(1)
        };
        if done.is_err() {
            self.r[15] = here;
            return done;
        }
        self.r[15] = next;
        if in_block {
            // ARM DDI 0403 A7.3.2.
            let block = self.it_state();
            self.set_it_state(if block & 7 == 0 { 0 } else { block & 0xe0 | block << 1 & 0x1f });
        }
        done
    }

    #[inline(always)]
    fn perform(&mut self, op: Op, quiet: bool, here: u32, memory: &Memory, next: &mut u32) -> Cycles {
        match op.kind {
            Kind::Unknown | Kind::Refused => return Err(Refused),
            Kind::Constant => return Ok(self.constant(op, op.operation(), quiet, next)),
            Kind::Register => return Ok(self.register(op, op.operation(), quiet, next)),
            Kind::MoveConstant => {
                self.set(op.d(), op.value);
                if op.has(op::FLAGS) && !quiet {
                    self.set_nz(op.value);
                }
            }
            Kind::AddConstant => return Ok(self.constant(op, DpOp::Add, quiet, next)),
            Kind::SubConstant => return Ok(self.constant(op, DpOp::Sub, quiet, next)),
            Kind::CompareConstant => return Ok(self.constant(op, DpOp::Cmp, quiet, next)),
            Kind::AddRegister => return Ok(self.plain(op, DpOp::Add, quiet)),
            Kind::SubRegister => return Ok(self.plain(op, DpOp::Sub, quiet)),
            Kind::MoveRegister => return Ok(self.plain(op, DpOp::Mov, quiet)),
            Kind::CompareRegister => return Ok(self.plain(op, DpOp::Cmp, quiet)),
            Kind::Shift => {
                let amount = self.get(op.m()) & 0xff;
                let carry = self.has(xpsr::C);
                let (result, carry) = alu::shift_by_register(op.shift().ty, self.get(op.n()), amount, carry);
                self.set(op.d(), result);
                if op.has(op::FLAGS) && !quiet {
                    self.set_nzcv((result, carry, self.has(xpsr::V)));
                }
            }
            Kind::MoveTop => self.set(op.d(), self.get(op.d()) & 0xffff | op.value),
            Kind::Branch => return Ok(go(next, op.value)),
            Kind::BranchIf => {
                if self.holds(op.m()) {
                    return Ok(go(next, op.value));
                }
            }
            Kind::BranchLink => {
                self.r[LR] = here.wrapping_add(4) | 1;
                return Ok(go(next, op.value));
            }
            Kind::BranchZero => {
                if self.get(op.n()) == 0 {
                    return Ok(go(next, op.value));
                }
            }
            Kind::BranchNonzero => {
                if self.get(op.n()) != 0 {
                    return Ok(go(next, op.value));
                }
            }
            Kind::Exchange => return Ok(go(next, interworking(self.get(op.m()))?)),
            Kind::LinkExchange => {
                // LR as it was, if it is the register.
                let target = interworking(self.get(op.m()))?;
                self.r[LR] = here.wrapping_add(2) | 1;
                return Ok(go(next, target));
            }
            Kind::TableOfBytes | Kind::TableOfHalves => return self.table_branch(op, memory, next),
            Kind::It => self.set_it_state(op.value as u8),
            Kind::LoadByte => return self.load(op, memory, Width::U8, |value| value),
            Kind::LoadHalf => return self.load(op, memory, Width::U16, |value| value),
            Kind::LoadWord => return self.load(op, memory, Width::U32, |value| value),
            Kind::LoadSignedByte => return self.load(op, memory, Width::U8, signed_byte),
            Kind::LoadSignedHalf => return self.load(op, memory, Width::U16, signed_half),
            Kind::LoadPc => {
                let (address, moved) = self.address(op);
                let target = interworking(read(memory, address, Width::U32)?)?;
                self.write_back(op, moved);
                return Ok(1 + go(next, target));
            }
            Kind::StoreByte => return self.store(op, memory, Width::U8),
            Kind::StoreHalf => return self.store(op, memory, Width::U16),
            Kind::StoreWord => return self.store(op, memory, Width::U32),
            Kind::Literal => {
                let value = read(memory, op.value, Width::U32)?;
                self.set(op.d(), value);
                return Ok(2);
            }
            Kind::LoadByteAt => return self.load_at(op, memory, Width::U8, |value| value),
            Kind::LoadHalfAt => return self.load_at(op, memory, Width::U16, |value| value),
            Kind::LoadWordAt => return self.load_at(op, memory, Width::U32, |value| value),
            Kind::LoadSignedByteAt => return self.load_at(op, memory, Width::U8, signed_byte),
            Kind::LoadSignedHalfAt => return self.load_at(op, memory, Width::U16, signed_half),
            Kind::StoreByteAt => return self.store_at(op, memory, Width::U8),
            Kind::StoreHalfAt => return self.store_at(op, memory, Width::U16),
            Kind::StoreWordAt => return self.store_at(op, memory, Width::U32),
            Kind::LoadDual | Kind::StoreDual => return self.dual(op, memory),
            Kind::LoadMultiple | Kind::StoreMultiple => return self.multiple(op, memory, next),
            Kind::Multiply => {
                let result = self.get(op.n()).wrapping_mul(self.get(op.m()));
                self.set(op.d(), result);
                if op.has(op::FLAGS) && !quiet {
                    self.set_nz(result);
                }
            }
            Kind::MultiplyAdd => {
                let product = self.get(op.n()).wrapping_mul(self.get(op.m()));
                self.set(op.d(), self.get(op.a()).wrapping_add(product));
            }
            Kind::MultiplySubtract => {
                let product = self.get(op.n()).wrapping_mul(self.get(op.m()));
                self.set(op.d(), self.get(op.a()).wrapping_sub(product));
            }
            Kind::MultiplyLong => return Ok(self.multiply_long(op)),
            Kind::Divide => {
                let (a, b) = (self.get(op.n()), self.get(op.m()));
                let result = match (b, op.value) {
                    // A fault if CCR.DIV_0_TRP is set.
                    (0, _) => return Err(Refused),
                    (_, op::SIGNED) => (a as i32).wrapping_div(b as i32) as u32,
                    _ => a / b,
                };
                self.set(op.d(), result);
                return Ok(3);
            }
            Kind::ExtendByte => self.extend(op, |value| value & 0xff),
            Kind::ExtendHalf => self.extend(op, |value| value & 0xffff),
            Kind::ExtendSignedByte => self.extend(op, signed_byte),
            Kind::ExtendSignedHalf => self.extend(op, signed_half),
            Kind::CountZeros => self.set(op.d(), self.get(op.m()).leading_zeros()),
            Kind::ReverseBits => self.set(op.d(), self.get(op.m()).reverse_bits()),
            Kind::ReverseBytes => self.set(op.d(), self.get(op.m()).swap_bytes()),
            Kind::ReverseHalves => self.set(op.d(), self.get(op.m()).swap_bytes().rotate_left(16)),
            Kind::ReverseSigned => self.set(op.d(), (self.get(op.m()) as u16).swap_bytes() as i16 as u32),
            Kind::Extract | Kind::ExtractSigned | Kind::Insert | Kind::Clear => self.bitfield(op),
            Kind::ReadMask => {
                let value = if op.value == PRIMASK { self.primask.into() } else { self.basepri.into() };
                self.set(op.d(), value);
            }
            Kind::WriteMask | Kind::SetMask if !self.is_undisturbed => return Err(Refused),
            Kind::WriteMask => self.write_mask(op.value, self.get(op.n())),
            Kind::SetMask => self.primask = op.value != 0,
            Kind::Nothing => {}
        }
        Ok(1)
    }

    /// Data processing with a constant.
    #[inline(always)]
    fn constant(&mut self, op: Op, operation: DpOp, quiet: bool, next: &mut u32) -> u64 {
        let carry = self.has(xpsr::C);
        let shifted = if op.has(op::CARRY_KNOWN) { op.has(op::CARRY) } else { carry };
        self.process(op, operation, quiet, (op.value, shifted), next)
    }

    /// With a shifted register.
    #[inline(always)]
    fn register(&mut self, op: Op, operation: DpOp, quiet: bool, next: &mut u32) -> u64 {
        let b = alu::shift_by(op.shift(), self.get(op.m()), self.has(xpsr::C));
        self.process(op, operation, quiet, b, next)
    }

    /// With a register as it is; the result is for no PC.
    #[inline(always)]
    fn plain(&mut self, op: Op, operation: DpOp, quiet: bool) -> u64 {
        let b = (self.get(op.m()), self.has(xpsr::C));
        self.process(op, operation, quiet, b, &mut 0)
    }

    #[inline(always)]
    fn process(&mut self, op: Op, operation: DpOp, quiet: bool, b: (u32, bool), next: &mut u32) -> u64 {
        let a = if operation.is_unary() { 0 } else { self.get(op.n()) };
        let (carry, overflow) = (self.has(xpsr::C), self.has(xpsr::V));
        let sum = alu::data_processing(operation, a, b.0, carry, b.1, overflow);
        let mut cycles = 1;
        if !operation.is_test() {
            if op.d() == PC {
                cycles = go(next, sum.0 & !1);
            } else {
                self.set(op.d(), sum.0);
            }
        }
        if op.has(op::FLAGS) && (!quiet || operation.is_test()) {
            self.set_nzcv(sum);
        }
        cycles
    }

    fn multiply_long(&mut self, op: Op) -> u64 {
        let (a, b) = (self.get(op.n()), self.get(op.m()));
        let product = if op.value & op::SIGNED != 0 {
            (i64::from(a as i32) * i64::from(b as i32)) as u64
        } else {
            u64::from(a) * u64::from(b)
        };
        let sum = u64::from(self.get(op.a())) << 32 | u64::from(self.get(op.d()));
        let result = if op.value & op::ACCUMULATE != 0 { product.wrapping_add(sum) } else { product };
        self.set(op.d(), result as u32);
        self.set(op.a(), (result >> 32) as u32);
        2
    }

    #[inline(always)]
    fn extend(&mut self, op: Op, extend: impl Fn(u32) -> u32) {
        let value = extend(self.get(op.m()).rotate_right(op.value));
        self.set(op.d(), if op.n() == PC { value } else { self.get(op.n()).wrapping_add(value) });
    }

    fn bitfield(&mut self, op: Op) {
        let (lsb, width) = (op.value & 31, (op.value >> 8).clamp(1, 32));
        let unused = 32 - width;
        let mask = u32::MAX >> unused;
        let field = self.get(op.n()) >> lsb & mask;
        let hole = self.get(op.d()) & !(mask << lsb);
        let result = match op.kind {
            Kind::Extract => field,
            Kind::ExtractSigned => ((field << unused) as i32 >> unused) as u32,
            Kind::Insert => hole | (self.get(op.n()) & mask) << lsb,
            _ => hole,
        };
        self.set(op.d(), result);
    }

    fn write_mask(&mut self, number: u32, value: u32) {
        let level = value as u8;
        match number {
            PRIMASK => self.primask = value & 1 != 0,
            BASEPRI => self.basepri = level,
            // BASEPRI_MAX only ever masks more.
            _ if level != 0 && (self.basepri == 0 || level < self.basepri) => self.basepri = level,
            _ => {}
        }
    }
}

const PRIMASK: u32 = op::PRIMASK as u32;
const BASEPRI: u32 = op::BASEPRI as u32;

#[inline]
fn signed_byte(value: u32) -> u32 {
    value as u8 as i8 as u32
}

#[inline]
fn signed_half(value: u32) -> u32 {
    value as u16 as i16 as u32
}
