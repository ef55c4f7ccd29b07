//! A decoded instruction in eight bytes, so that a loop of them stays in the host's cache.
//!
//! Made from what the emulator's decoder returns, with absolute addresses in place of distances. Instructions that the fast
//! path does not execute are [`Kind::Refused`].

use rsemu::cpu::arm::v7m::isa::{DpOp, Shift, ShiftType};

/// The operation. Registers are D, N, M and A; constants and options are in the value and the bits.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    /// Not decoded yet.
    Unknown,
    /// The emulator executes it.
    Refused,
    /// Data processing with a constant, and with a shifted register: [`Op::operation`]. The commonest have kinds of their own.
    Constant,
    Register,
    MoveConstant,
    AddConstant,
    SubConstant,
    CompareConstant,
    AddRegister,
    SubRegister,
    MoveRegister,
    CompareRegister,
    /// A shift by a register: [`Op::shift`].
    Shift,
    MoveTop,
    /// To the value: always, on the condition in M, with a link.
    Branch,
    BranchIf,
    BranchLink,
    /// If N is zero, and if it is not.
    BranchZero,
    BranchNonzero,
    Exchange,
    LinkExchange,
    TableOfBytes,
    TableOfHalves,
    It,
    /// With a constant offset, or at a constant address.
    LoadByte,
    LoadHalf,
    LoadWord,
    LoadSignedByte,
    LoadSignedHalf,
    LoadPc,
    StoreByte,
    StoreHalf,
    StoreWord,
    Literal,
    /// With the offset in M.
    LoadByteAt,
    LoadHalfAt,
    LoadWordAt,
    LoadSignedByteAt,
    LoadSignedHalfAt,
    StoreByteAt,
    StoreHalfAt,
    StoreWordAt,
    /// D and A.
    LoadDual,
    StoreDual,
    /// The list is the value.
    LoadMultiple,
    StoreMultiple,
    Multiply,
    MultiplyAdd,
    MultiplySubtract,
    /// Into D (low) and A (high): [`SIGNED`], [`ACCUMULATE`].
    MultiplyLong,
    /// [`SIGNED`].
    Divide,
    /// Rotated by the value, and added to N unless that is R15.
    ExtendByte,
    ExtendHalf,
    ExtendSignedByte,
    ExtendSignedHalf,
    CountZeros,
    ReverseBits,
    ReverseBytes,
    ReverseHalves,
    ReverseSigned,
    /// Position and width are in the value.
    Extract,
    ExtractSigned,
    Insert,
    Clear,
    /// PRIMASK and BASEPRI: the value is the number of the register.
    ReadMask,
    WriteMask,
    /// PRIMASK becomes the value.
    SetMask,
    Nothing,
}

/// Four bytes long, not two.
pub const WIDE: u8 = 1;
/// Sets the flags.
pub const FLAGS: u8 = 1 << 1;
/// The constant says what the carry is, and what.
pub const CARRY_KNOWN: u8 = 1 << 2;
pub const CARRY: u8 = 1 << 3;
/// Writes the address back to N.
pub const BACK: u8 = 1 << 2;
/// The offset is added after the access.
pub const AFTER: u8 = 1 << 3;
/// Of [`Kind::MultiplyLong`] and [`Kind::Divide`], in the value.
pub const SIGNED: u32 = 1;
pub const ACCUMULATE: u32 = 2;

/// Numbers of special registers in MRS and MSR (ARM DDI 0403 table B5-1).
pub const PRIMASK: u8 = 16;
pub const BASEPRI: u8 = 17;
pub const BASEPRI_MAX: u8 = 18;

/// Program counter.
pub const PC: u8 = 15;

pub const OPERATIONS: [DpOp; 16] = [
    DpOp::And,
    DpOp::Bic,
    DpOp::Orr,
    DpOp::Orn,
    DpOp::Eor,
    DpOp::Add,
    DpOp::Adc,
    DpOp::Sbc,
    DpOp::Sub,
    DpOp::Rsb,
    DpOp::Mov,
    DpOp::Mvn,
    DpOp::Tst,
    DpOp::Teq,
    DpOp::Cmp,
    DpOp::Cmn,
];
pub const SHIFTS: [ShiftType; 5] =
    [ShiftType::Lsl, ShiftType::Lsr, ShiftType::Asr, ShiftType::Ror, ShiftType::Rrx];

/// A decoded instruction.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Op {
    pub kind: Kind,
    pub bits: u8,
    /// D and N, M and A: four bits each.
    dn: u8,
    ma: u8,
    pub value: u32,
}

impl Op {
    pub const UNKNOWN: Op = Op::new(Kind::Unknown);

    pub const fn new(kind: Kind) -> Op {
        Op { kind, bits: 0, dn: 0, ma: 0, value: 0 }
    }

    #[inline]
    pub fn d(self) -> u8 {
        self.dn & 15
    }

    #[inline]
    pub fn n(self) -> u8 {
        self.dn >> 4
    }

    #[inline]
    pub fn m(self) -> u8 {
        self.ma & 15
    }

    #[inline]
    pub fn a(self) -> u8 {
        self.ma >> 4
    }

    #[inline]
    pub fn has(self, bits: u8) -> bool {
        self.bits & bits != 0
    }

    /// Of [`Kind::Constant`] and [`Kind::Register`]: it is in the upper four bits.
    #[inline]
    pub fn operation(self) -> DpOp {
        OPERATIONS[usize::from(self.bits >> 4)]
    }

    /// How M is shifted.
    #[inline]
    pub fn shift(self) -> Shift {
        let ty = SHIFTS.get((self.value & 0xff) as usize).copied().unwrap_or(ShiftType::Lsl);
        Shift { ty, amount: (self.value >> 8) as u8 }
    }

    pub fn regs(mut self, d: u8, n: u8, m: u8, a: u8) -> Op {
        (self.dn, self.ma) = (d & 15 | n << 4, m & 15 | a << 4);
        self
    }

    pub fn with(mut self, bits: u8, on: bool) -> Op {
        self.bits |= if on { bits } else { 0 };
        self
    }

    pub fn value(mut self, value: u32) -> Op {
        self.value = value;
        self
    }
}
