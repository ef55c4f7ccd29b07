//! The barrel shifter and the arithmetic of the data-processing instructions (ARM DDI 0403 A2.2.1, A7.4.2).

use rsemu::cpu::arm::v7m::isa::{DpOp, Shift, ShiftType};

/// A result, its carry and its overflow.
pub type Sum = (u32, bool, bool);

/// `value` shifted by a constant, and the carry out of the shifter.
#[inline]
pub fn shift_by(shift: Shift, value: u32, carry: bool) -> (u32, bool) {
    match shift.ty {
        ShiftType::Lsl if shift.amount == 0 => (value, carry),
        ShiftType::Rrx => (u32::from(carry) << 31 | value >> 1, value & 1 != 0),
        ty => shift_by_register(ty, value, u32::from(shift.amount), carry),
    }
}

/// `value` shifted by the low byte of a register, and the carry out of the shifter.
#[inline]
pub fn shift_by_register(ty: ShiftType, value: u32, amount: u32, carry: bool) -> (u32, bool) {
    if amount == 0 {
        return (value, carry);
    }
    // Widened, so that a shift by 32 or more leaves the right carry behind.
    let far = amount.min(33);
    match ty {
        ShiftType::Lsl => {
            let wide = u64::from(value) << far;
            (wide as u32, wide >> 32 & 1 != 0)
        }
        ShiftType::Lsr => {
            let wide = u64::from(value) << 1 >> far;
            ((u64::from(value) >> far) as u32, wide & 1 != 0)
        }
        ShiftType::Asr => {
            let wide = i64::from(value as i32);
            ((wide >> far) as u32, wide << 1 >> far & 1 != 0)
        }
        ShiftType::Ror | ShiftType::Rrx => {
            let result = value.rotate_right(amount % 32);
            (result, result >> 31 != 0)
        }
    }
}

/// `a + b + carry`.
#[inline]
pub fn add(a: u32, b: u32, carry: bool) -> Sum {
    let wide = u64::from(a) + u64::from(b) + u64::from(carry);
    let result = wide as u32;
    (result, wide >> 32 != 0, (a ^ result) & (b ^ result) & 1 << 31 != 0)
}

/// A data-processing operation; what it leaves as they are of the flags comes in: the carry flag, the carry out of the
/// shifter, the overflow flag.
#[inline(always)]
pub fn data_processing(op: DpOp, a: u32, b: u32, carry: bool, shifted: bool, overflow: bool) -> Sum {
    match op {
        DpOp::And | DpOp::Tst => (a & b, shifted, overflow),
        DpOp::Bic => (a & !b, shifted, overflow),
        DpOp::Orr => (a | b, shifted, overflow),
        DpOp::Orn => (a | !b, shifted, overflow),
        DpOp::Eor | DpOp::Teq => (a ^ b, shifted, overflow),
        DpOp::Add | DpOp::Cmn => add(a, b, false),
        DpOp::Adc => add(a, b, carry),
        DpOp::Sbc => add(a, !b, carry),
        DpOp::Sub | DpOp::Cmp => add(a, !b, true),
        DpOp::Rsb => add(!a, b, true),
        DpOp::Mov => (b, shifted, overflow),
        DpOp::Mvn => (!b, shifted, overflow),
    }
}
