//! Makes an [`Op`] of what the emulator's decoder returns.

use rsemu::cpu::arm::v7m::isa::{
    BitfieldOp, DpOp, ExtendOp, HintOp, Insn, MemOffset, MiscOp, Operand, ShiftType, Size,
};

use super::op::{
    ACCUMULATE, AFTER, BACK, BASEPRI, BASEPRI_MAX, CARRY, CARRY_KNOWN, FLAGS, Kind, OPERATIONS, Op, PC,
    PRIMASK, SHIFTS, SIGNED, WIDE,
};

impl Op {
    /// The operation of `instruction` at `address`.
    pub fn of(instruction: Insn, is_wide: bool, address: u32) -> Op {
        Op::lowered(instruction, address.wrapping_add(4)).with(WIDE, is_wide)
    }

    /// `pc` is what R15 reads as.
    fn lowered(instruction: Insn, pc: u32) -> Op {
        let refused = Op::new(Kind::Refused);
        match instruction {
            Insn::DataProc { op, s, rd, rn, operand } => data_processing(op, s, rd, rn, operand),
            Insn::ShiftReg { ty, s, rd, rn, rm } => {
                Op::new(Kind::Shift).regs(rd, rn, rm, 0).with(FLAGS, s).value(shift_number(ty))
            }
            Insn::Adr { rd, imm, add } => {
                Op::new(Kind::MoveConstant).regs(rd, 0, 0, 0).value(offset(pc & !3, imm, add))
            }
            Insn::MovImm16 { top: false, rd, imm } => {
                Op::new(Kind::MoveConstant).regs(rd, 0, 0, 0).value(imm.into())
            }
            Insn::MovImm16 { top: true, rd, imm } => {
                Op::new(Kind::MoveTop).regs(rd, 0, 0, 0).value(u32::from(imm) << 16)
            }
            Insn::Branch { cond, offset } => {
                let op =
                    cond.map_or(Op::new(Kind::Branch), |cond| Op::new(Kind::BranchIf).regs(0, 0, cond.0, 0));
                op.value(pc.wrapping_add(offset as u32) & !1)
            }
            Insn::BranchLink { offset } => {
                Op::new(Kind::BranchLink).value(pc.wrapping_add(offset as u32) & !1)
            }
            Insn::Cbz { nonzero, rn, offset } => {
                let kind = if nonzero { Kind::BranchNonzero } else { Kind::BranchZero };
                Op::new(kind).regs(0, rn, 0, 0).value(pc.wrapping_add(offset) & !1)
            }
            Insn::Bx { rm } => Op::new(Kind::Exchange).regs(0, 0, rm, 0),
            Insn::Blx { rm } => Op::new(Kind::LinkExchange).regs(0, 0, rm, 0),
            Insn::TableBranch { rn, rm, half } => {
                let kind = if half { Kind::TableOfHalves } else { Kind::TableOfBytes };
                Op::new(kind).regs(0, rn, rm, 0)
            }
            Insn::It { cond, mask } => Op::new(Kind::It).value(u32::from(cond.0 << 4 | mask)),
            Insn::LoadStore { load, size, signed, rt, rn, offset: by, index, add, wback, unpriv: false } => {
                match (by, load, rt) {
                    (MemOffset::Imm(imm), true, PC) if size == Size::Word => Op::new(Kind::LoadPc)
                        .regs(rt, rn, 0, 0)
                        .with(BACK, wback)
                        .with(AFTER, !index)
                        .value(offset(0, imm, add)),
                    (_, true, PC) => refused,
                    (MemOffset::Imm(imm), ..) => Op::new(access(load, size, signed, false))
                        .regs(rt, rn, 0, 0)
                        .with(BACK, wback)
                        .with(AFTER, !index)
                        .value(offset(0, imm, add)),
                    (MemOffset::Reg { rm, lsl }, ..) if add && index && !wback => {
                        Op::new(access(load, size, signed, true)).regs(rt, rn, rm, 0).value(lsl.into())
                    }
                    _ => refused,
                }
            }
            Insn::LoadLiteral { size: Size::Word, rt, imm, add, .. } if rt != PC => {
                Op::new(Kind::Literal).regs(rt, 0, 0, 0).value(offset(pc & !3, imm, add))
            }
            Insn::LoadStoreDual { load, rt, rt2, rn, imm, index, add, wback } if rn != PC => {
                Op::new(if load { Kind::LoadDual } else { Kind::StoreDual })
                    .regs(rt, rn, 0, rt2)
                    .with(BACK, wback)
                    .with(AFTER, !index)
                    .value(offset(0, imm, add))
            }
            Insn::LoadStoreMultiple { load, rn, list, wback, before } if list != 0 => {
                Op::new(if load { Kind::LoadMultiple } else { Kind::StoreMultiple })
                    .regs(0, rn, 0, 0)
                    .with(BACK, wback)
                    .with(AFTER, !before)
                    .value(list.into())
            }
            Insn::Mul { rd, rn, rm, ra, sub, s } => {
                let kind = match (ra, sub) {
                    (None, _) => Kind::Multiply,
                    (_, false) => Kind::MultiplyAdd,
                    (_, true) => Kind::MultiplySubtract,
                };
                Op::new(kind).regs(rd, rn, rm, ra.unwrap_or_default()).with(FLAGS, s)
            }
            Insn::MulLong { signed, accumulate, rdlo, rdhi, rn, rm, umaal: false } => {
                let how = if signed { SIGNED } else { 0 } | if accumulate { ACCUMULATE } else { 0 };
                Op::new(Kind::MultiplyLong).regs(rdlo, rn, rm, rdhi).value(how)
            }
            Insn::Div { signed, rd, rn, rm } => {
                Op::new(Kind::Divide).regs(rd, rn, rm, 0).value(if signed { SIGNED } else { 0 })
            }
            Insn::Extend { op, rd, rn, rm, rotate } => {
                let kind = match op {
                    ExtendOp::Uxtb => Kind::ExtendByte,
                    ExtendOp::Uxth => Kind::ExtendHalf,
                    ExtendOp::Sxtb => Kind::ExtendSignedByte,
                    ExtendOp::Sxth => Kind::ExtendSignedHalf,
                    _ => Kind::Refused,
                };
                Op::new(kind).regs(rd, rn, rm, 0).value(rotate.into())
            }
            Insn::Misc { op, rd, rm } => {
                let kind = match op {
                    MiscOp::Clz => Kind::CountZeros,
                    MiscOp::Rbit => Kind::ReverseBits,
                    MiscOp::Rev => Kind::ReverseBytes,
                    MiscOp::Rev16 => Kind::ReverseHalves,
                    MiscOp::Revsh => Kind::ReverseSigned,
                };
                Op::new(kind).regs(rd, 0, rm, 0)
            }
            Insn::Bitfield { op, rd, rn, lsb, width } => {
                let kind = match op {
                    BitfieldOp::Ubfx => Kind::Extract,
                    BitfieldOp::Sbfx => Kind::ExtractSigned,
                    BitfieldOp::Bfi => Kind::Insert,
                    BitfieldOp::Bfc => Kind::Clear,
                };
                Op::new(kind).regs(rd, rn, 0, 0).value(u32::from(lsb) | u32::from(width) << 8)
            }
            Insn::Mrs { rd, sysm: sysm @ (PRIMASK | BASEPRI | BASEPRI_MAX) } => {
                Op::new(Kind::ReadMask).regs(rd, 0, 0, 0).value(sysm.into())
            }
            Insn::Msr { rn, sysm: sysm @ (PRIMASK | BASEPRI | BASEPRI_MAX), .. } => {
                Op::new(Kind::WriteMask).regs(0, rn, 0, 0).value(sysm.into())
            }
            Insn::Cps { enable, i: true, f: false } => Op::new(Kind::SetMask).value(u32::from(!enable)),
            // Accesses are in order as they are.
            Insn::Barrier { .. } | Insn::Hint { op: HintOp::Nop } => Op::new(Kind::Nothing),
            _ => refused,
        }
    }
}

fn data_processing(op: DpOp, s: bool, rd: u8, rn: u8, operand: Operand) -> Op {
    let (general, common) = match (operand, op) {
        (Operand::Imm { carry: None, .. }, DpOp::Mov) => (Kind::Constant, Some(Kind::MoveConstant)),
        (Operand::Imm { .. }, DpOp::Add) => (Kind::Constant, Some(Kind::AddConstant)),
        (Operand::Imm { .. }, DpOp::Sub) => (Kind::Constant, Some(Kind::SubConstant)),
        (Operand::Imm { .. }, DpOp::Cmp) => (Kind::Constant, Some(Kind::CompareConstant)),
        (Operand::Imm { .. }, _) => (Kind::Constant, None),
        (Operand::Reg { shift, .. }, DpOp::Add) if shift.is_none() => {
            (Kind::Register, Some(Kind::AddRegister))
        }
        (Operand::Reg { shift, .. }, DpOp::Sub) if shift.is_none() => {
            (Kind::Register, Some(Kind::SubRegister))
        }
        (Operand::Reg { shift, .. }, DpOp::Mov) if shift.is_none() => {
            (Kind::Register, Some(Kind::MoveRegister))
        }
        (Operand::Reg { shift, .. }, DpOp::Cmp) if shift.is_none() => {
            (Kind::Register, Some(Kind::CompareRegister))
        }
        (Operand::Reg { .. }, _) => (Kind::Register, None),
    };
    // The common kinds write to no PC.
    let kind = common.filter(|_| rd != PC || op.is_test()).unwrap_or(general);
    let number = OPERATIONS.iter().position(|known| *known == op).unwrap_or_default() as u8;
    let base = Op::new(kind).with(number << 4, true).with(FLAGS, s);
    match operand {
        Operand::Imm { value, carry } => base
            .regs(rd, rn, 0, 0)
            .with(CARRY_KNOWN, carry.is_some())
            .with(CARRY, carry == Some(true))
            .value(value),
        Operand::Reg { rm, shift } => {
            base.regs(rd, rn, rm, 0).value(shift_number(shift.ty) | u32::from(shift.amount) << 8)
        }
    }
}

fn shift_number(ty: ShiftType) -> u32 {
    SHIFTS.iter().position(|known| *known == ty).unwrap_or_default() as u32
}

fn access(load: bool, size: Size, signed: bool, indexed: bool) -> Kind {
    match (load, size, signed, indexed) {
        (true, Size::Byte, false, false) => Kind::LoadByte,
        (true, Size::Half, false, false) => Kind::LoadHalf,
        (true, Size::Byte, true, false) => Kind::LoadSignedByte,
        (true, Size::Half, true, false) => Kind::LoadSignedHalf,
        (true, Size::Word, _, false) => Kind::LoadWord,
        (true, Size::Byte, false, true) => Kind::LoadByteAt,
        (true, Size::Half, false, true) => Kind::LoadHalfAt,
        (true, Size::Byte, true, true) => Kind::LoadSignedByteAt,
        (true, Size::Half, true, true) => Kind::LoadSignedHalfAt,
        (true, Size::Word, _, true) => Kind::LoadWordAt,
        (false, Size::Byte, _, false) => Kind::StoreByte,
        (false, Size::Half, _, false) => Kind::StoreHalf,
        (false, Size::Word, _, false) => Kind::StoreWord,
        (false, Size::Byte, _, true) => Kind::StoreByteAt,
        (false, Size::Half, _, true) => Kind::StoreHalfAt,
        (false, Size::Word, _, true) => Kind::StoreWordAt,
    }
}

fn offset(base: u32, by: u32, add: bool) -> u32 {
    if add { base.wrapping_add(by) } else { base.wrapping_sub(by) }
}
