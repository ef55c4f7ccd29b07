//! The registers and flags that the fast path reads and writes, where branches lead, and what refuses an instruction.

use rsemu::cpu::arm::v7m::isa::Cond;
use rsemu::cpu::arm::v7m::xpsr;

use super::alu;
use super::op::PC;

/// The upper sixteenth of the address space: a branch there is an exception return.
const MAGIC: u32 = 0xf000_0000;
/// The flags N, Z, C and V, and where they begin.
const NZCV: u32 = xpsr::N | xpsr::Z | xpsr::C | xpsr::V;
const NZCV_AT: u32 = 28;

/// For each condition, for which values of the flags it holds.
const HOLDS: [u16; 16] = {
    let mut holds = [0; 16];
    let mut condition = 0;
    while condition < 16 {
        let mut flags = 0;
        while flags < 16 {
            if Cond(condition as u8).passes(flags << NZCV_AT) {
                holds[condition] |= 1 << flags;
            }
            flags += 1;
        }
        condition += 1;
    }
    holds
};

/// The registers that the fast path reads and writes.
pub struct State {
    /// R0 to R15; R15 is the address of the next instruction.
    pub r: [u32; 16],
    pub xpsr: u32,
    /// Exception masks.
    pub primask: bool,
    pub basepri: u8,
    /// No enabled exception is pending: a change of the masks lets none in.
    pub is_undisturbed: bool,
}

/// The emulator has to execute this instruction.
pub struct Refused;

pub type Cycles = Result<u64, Refused>;

impl State {
    #[inline(always)]
    pub fn get(&self, register: u8) -> u32 {
        self.r[usize::from(register & 15)]
    }

    /// Only branches write to R15.
    #[inline(always)]
    pub fn set(&mut self, register: u8, value: u32) {
        if register != PC {
            self.r[usize::from(register & 15)] = value;
        }
    }

    #[inline]
    pub fn holds(&self, condition: u8) -> bool {
        HOLDS[usize::from(condition & 15)] >> (self.xpsr >> NZCV_AT) & 1 != 0
    }

    #[inline]
    pub fn has(&self, flag: u32) -> bool {
        self.xpsr & flag != 0
    }

    #[inline]
    pub fn set_nz(&mut self, result: u32) {
        let zero = if result == 0 { xpsr::Z } else { 0 };
        self.xpsr = self.xpsr & !(xpsr::N | xpsr::Z) | result & xpsr::N | zero;
    }

    #[inline]
    pub fn set_nzcv(&mut self, (result, carry, overflow): alu::Sum) {
        let zero = if result == 0 { xpsr::Z } else { 0 };
        let carry = if carry { xpsr::C } else { 0 };
        let overflow = if overflow { xpsr::V } else { 0 };
        self.xpsr = self.xpsr & !NZCV | result & xpsr::N | zero | carry | overflow;
    }

    /// ITSTATE: its upper six bits are bits 15 to 10, its lower two bits 26 and 25.
    #[inline]
    pub fn it_state(&self) -> u8 {
        ((self.xpsr >> 10 & 0x3f) << 2 | self.xpsr >> 25 & 3) as u8
    }

    #[inline]
    pub fn set_it_state(&mut self, state: u8) {
        let state = u32::from(state);
        self.xpsr = self.xpsr & !xpsr::IT_MASK | (state >> 2) << 10 | (state & 3) << 25;
    }
}

/// A branch to `target`; returns its cycles.
#[inline]
pub fn go(next: &mut u32, target: u32) -> u64 {
    *next = target;
    3
}

/// The address that a branch to `target` leads to, unless it is a fault or an exception return.
#[inline]
pub fn interworking(target: u32) -> Result<u32, Refused> {
    if target & 1 == 0 || target & MAGIC == MAGIC { Err(Refused) } else { Ok(target & !1) }
}
