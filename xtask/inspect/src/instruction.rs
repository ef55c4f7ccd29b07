//! What an instruction does to the flow of control and to the stack pointer; nothing else of it matters here.
//!
//! Source: ARM DDI 0403 (ARMv7-M), decoded by Capstone. What moves the stack pointer in a way that is not known here is
//! [`Stack::Unknown`], and an error where it is met.

use std::collections::BTreeMap;

use capstone::arch::arm::{ArchExtraMode, ArchMode, ArmCC, ArmInsn, ArmOperand, ArmOperandType, ArmReg};
use capstone::arch::{BuildsCapstone, BuildsCapstoneExtraMode, DetailsArchInsn};
use capstone::{Capstone, Insn, RegAccessType, RegId};

use crate::Error;
use crate::elf::Image;

/// Bytes of a core register.
const WORD: i32 = 4;
/// Bytes of a double-precision register.
const DOUBLE: i32 = 8;

/// Where control goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flow {
    /// To the next instruction.
    Next,
    /// To another, of this function or of one that ends this one.
    Jump {
        /// Its address.
        to: u32,
        /// Whether it never goes to the next instead.
        always: bool,
    },
    /// To a function and back.
    Call {
        /// Its address.
        to: u32,
    },
    /// To a function whose address is in a register, and back.
    CallRegister,
    /// To a function whose address is in a register, which ends this one.
    JumpRegister {
        /// Whether it never goes to the next instead.
        always: bool,
    },
    /// To one of several places of this function, by offsets in halfwords from the next instruction.
    Table {
        /// Bytes of an offset.
        entry: u32,
        /// The register that holds where the offsets are; they follow if there is none.
        base: Option<u16>,
    },
    /// To the caller.
    Return {
        /// Whether it never goes to the next instead.
        always: bool,
    },
    /// Nowhere.
    Stop,
}

/// What happens to the stack pointer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stack {
    /// Nothing.
    Same,
    /// It goes down by this many bytes (up, if negative).
    Down(i32),
    /// It is set to what is in a register: another stack begins.
    Another,
    /// Something this module cannot tell.
    Unknown,
}

/// An instruction.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Instruction {
    /// Where the next one is.
    pub next: u32,
    /// Where control goes.
    pub flow: Flow,
    /// What happens to the stack pointer.
    pub stack: Stack,
    /// The number of the condition it is executed under, if any.
    pub condition: Option<u32>,
    /// The frame pointer is set to this many bytes above the stack pointer.
    pub frame_pointer: Option<i32>,
    /// A register is loaded with an address nearby: register, address.
    pub nearby: Option<(u16, u32)>,
    /// Half of a register is loaded: register, whether it is the upper half, and with what.
    pub half: Option<(u16, bool, u32)>,
    /// It reads or writes the floating-point registers. The core keeps them through an interrupt from then on.
    pub floating: bool,
    /// As one reads it.
    pub text: String,
}

/// All instructions of an image, by address.
pub fn decode(image: &Image) -> Result<BTreeMap<u32, Instruction>, Error> {
    let mut capstone = Capstone::new().arm().mode(ArchMode::Thumb);
    capstone = capstone.extra_mode([ArchExtraMode::MClass].into_iter());
    let decoder = capstone.detail(true).build()?;
    let mut all = BTreeMap::new();
    for stretch in &image.code {
        let mut end = u64::from(stretch.address);
        for instruction in decoder.disasm_all(&stretch.bytes, end)?.iter() {
            let decoded = one(&decoder, instruction)?;
            end = u64::from(decoded.next);
            all.insert(instruction.address() as u32, decoded);
        }
        // Padding of fewer than two bytes is none.
        if end + 1 < u64::from(stretch.address) + stretch.bytes.len() as u64 {
            return Err(Error::new(format!("no instruction at {end:#010x}")));
        }
    }
    Ok(all)
}

/// The operands of an instruction, as far as they matter.
struct Operands {
    all: Vec<ArmOperand>,
    writes_back: bool,
}

impl Operands {
    fn register(&self, index: usize) -> Option<u16> {
        match self.all.get(index)?.op_type {
            ArmOperandType::Reg(RegId(register)) => Some(register),
            _ => None,
        }
    }

    fn number(&self, index: usize) -> Option<i32> {
        match self.all.get(index)?.op_type {
            ArmOperandType::Imm(number) => Some(number),
            _ => None,
        }
    }

    fn last_number(&self) -> Option<i32> {
        self.number(self.all.len().checked_sub(1)?)
    }

    /// Displacement of a memory operand that is relative to the stack pointer.
    fn at_stack(&self) -> Option<i32> {
        self.all.iter().find_map(|operand| match operand.op_type {
            ArmOperandType::Mem(place) if place.base().0 == SP => Some(place.disp()),
            _ => None,
        })
    }

    /// The register that a memory operand begins with, if it is not the program counter.
    fn base(&self) -> Option<u16> {
        self.all.iter().find_map(|operand| match operand.op_type {
            ArmOperandType::Mem(place) => Some(place.base().0).filter(|&base| base != PC),
            _ => None,
        })
    }

    fn has(&self, register: u16) -> bool {
        (0..self.all.len()).any(|index| self.register(index) == Some(register))
    }

    /// Bytes of the registers in a list that begins with this operand.
    fn bytes(&self, from: usize) -> i32 {
        let registers = (from..self.all.len()).filter_map(|index| self.register(index));
        registers.map(|register| if (D0..=D31).contains(&register) { DOUBLE } else { WORD }).sum()
    }

    fn writes_stack_pointer(&self) -> bool {
        let written = |operand: &ArmOperand| {
            let writes = matches!(operand.access, Some(RegAccessType::WriteOnly | RegAccessType::ReadWrite));
            writes && operand.op_type == ArmOperandType::Reg(RegId(SP))
        };
        self.all.iter().any(written)
            || self.writes_back && (self.at_stack().is_some() || self.register(0) == Some(SP))
    }
}

const SP: u16 = ArmReg::ARM_REG_SP as u16;
const LR: u16 = ArmReg::ARM_REG_LR as u16;
const PC: u16 = ArmReg::ARM_REG_PC as u16;
const R7: u16 = ArmReg::ARM_REG_R7 as u16;
const D0: u16 = ArmReg::ARM_REG_D0 as u16;
const D31: u16 = ArmReg::ARM_REG_D31 as u16;

fn one(decoder: &Capstone, instruction: &Insn<'_>) -> Result<Instruction, Error> {
    let text =
        format!("{} {}", instruction.mnemonic().unwrap_or("?"), instruction.op_str().unwrap_or_default());
    let detail = decoder.insn_detail(instruction)?;
    let architecture = detail.arch_detail();
    let arm = architecture.arm().ok_or_else(|| Error::new("the decoder does not know ARM"))?;
    let operands = Operands { all: arm.operands().collect(), writes_back: arm.writeback() };
    let always = matches!(arm.cc(), ArmCC::ARM_CC_AL | ArmCC::ARM_CC_INVALID);
    let id = ArmInsn::from(instruction.id().0);
    let flow = flow(id, &operands, always);
    let stack = stack(id, &operands);
    let condition = (!always).then_some(arm.cc() as u32);
    let frame_pointer = match id {
        ArmInsn::ARM_INS_ADD if operands.register(0) == Some(R7) && operands.register(1) == Some(SP) => {
            operands.number(2)
        }
        ArmInsn::ARM_INS_MOV if operands.register(0) == Some(R7) && operands.register(1) == Some(SP) => {
            Some(0)
        }
        _ => None,
    };
    let upper = match id {
        // Capstone calls `movw` a `mov`, too.
        ArmInsn::ARM_INS_MOV | ArmInsn::ARM_INS_MOVW => Some(false),
        ArmInsn::ARM_INS_MOVT => Some(true),
        _ => None,
    };
    let half = upper.zip(operands.register(0)).zip(operands.number(1));
    let half = half.map(|((upper, register), number)| (register, upper, number as u32 & 0xffff));
    // ARM DDI 0403 section A7.5: their names begin with a V, and of two older ones with an F.
    let floating = text.starts_with(['v', 'f']);
    let next = instruction.address() as u32 + instruction.len() as u32;
    // Relative to the program counter, which is two instructions ahead, at a word's beginning.
    let program_counter = (instruction.address() as u32 + 4) & !3;
    let nearby = match id {
        ArmInsn::ARM_INS_ADR => operands.register(0).zip(operands.number(1)),
        // The same with a longer reach.
        ArmInsn::ARM_INS_ADD | ArmInsn::ARM_INS_ADDW if operands.register(1) == Some(PC) => {
            operands.register(0).zip(operands.number(2))
        }
        ArmInsn::ARM_INS_SUB | ArmInsn::ARM_INS_SUBW if operands.register(1) == Some(PC) => {
            operands.register(0).zip(operands.number(2).map(i32::wrapping_neg))
        }
        _ => None,
    };
    let nearby = nearby.map(|(register, offset)| (register, program_counter.wrapping_add_signed(offset)));
    Ok(Instruction { next, flow, stack, condition, frame_pointer, nearby, half, floating, text })
}

fn flow(id: ArmInsn, operands: &Operands, always: bool) -> Flow {
    use ArmInsn::*;
    match id {
        ARM_INS_B => operands.last_number().map_or(Flow::Stop, |to| Flow::Jump { to: to as u32, always }),
        ARM_INS_CBZ | ARM_INS_CBNZ => {
            operands.last_number().map_or(Flow::Stop, |to| Flow::Jump { to: to as u32, always: false })
        }
        ARM_INS_BL => operands.last_number().map_or(Flow::CallRegister, |to| Flow::Call { to: to as u32 }),
        ARM_INS_BLX => Flow::CallRegister,
        ARM_INS_BX if operands.register(0) == Some(LR) => Flow::Return { always },
        ARM_INS_BX => Flow::JumpRegister { always },
        ARM_INS_TBB => Flow::Table { entry: 1, base: operands.base() },
        ARM_INS_TBH => Flow::Table { entry: 2, base: operands.base() },
        ARM_INS_POP | ARM_INS_LDM if operands.has(PC) => Flow::Return { always },
        // The return address is taken off the stack by itself.
        ARM_INS_LDR if operands.register(0) == Some(PC) && operands.at_stack().is_some() => {
            Flow::Return { always }
        }
        ARM_INS_UDF | ARM_INS_TRAP => Flow::Stop,
        _ if operands.register(0) == Some(PC) && operands.writes_program_counter() => {
            Flow::JumpRegister { always }
        }
        _ => Flow::Next,
    }
}

impl Operands {
    fn writes_program_counter(&self) -> bool {
        let first = self.all.first();
        first.is_some_and(|operand| {
            matches!(operand.access, Some(RegAccessType::WriteOnly | RegAccessType::ReadWrite))
        })
    }
}

fn stack(id: ArmInsn, operands: &Operands) -> Stack {
    use ArmInsn::*;
    let from_itself = operands.all.len() == 2 || operands.register(1) == Some(SP);
    match id {
        ARM_INS_PUSH | ARM_INS_VPUSH => Stack::Down(operands.bytes(0)),
        ARM_INS_POP | ARM_INS_VPOP if !operands.has(SP) => Stack::Down(-operands.bytes(0)),
        ARM_INS_SUB | ARM_INS_SUBW if operands.register(0) == Some(SP) && from_itself => {
            operands.last_number().map_or(Stack::Unknown, Stack::Down)
        }
        ARM_INS_ADD | ARM_INS_ADDW if operands.register(0) == Some(SP) && from_itself => {
            operands.last_number().map_or(Stack::Unknown, |number| Stack::Down(-number))
        }
        ARM_INS_STMDB | ARM_INS_VSTMDB if operands.register(0) == Some(SP) && operands.writes_back => {
            Stack::Down(operands.bytes(1))
        }
        ARM_INS_LDM | ARM_INS_VLDMIA if operands.register(0) == Some(SP) && operands.writes_back => {
            Stack::Down(-operands.bytes(1))
        }
        // [sp, #-n]! and [sp], #n: the latter has its number behind the place.
        ARM_INS_STR | ARM_INS_STRD | ARM_INS_LDR | ARM_INS_LDRD
            if operands.writes_back && operands.at_stack().is_some() =>
        {
            let ahead = operands.at_stack().unwrap_or_default();
            let number = operands.last_number().unwrap_or(ahead);
            Stack::Down(-number)
        }
        ARM_INS_MOV if operands.register(0) == Some(SP) => Stack::Another,
        _ if operands.writes_stack_pointer() => Stack::Unknown,
        _ => Stack::Same,
    }
}
