//! Differences that are known and decided: what the architecture manual says, and exactly what differs.
//!
//! A rule names the instruction, the registers and words that may differ, and the values that both cores must have in them. What
//! differs besides, or otherwise, is no known difference: the tests plant such results. `docs/witness.md` has the same list.
//! References are to ARM DDI 0403.

use rsemu::cpu::arm::v7m::fpisa::{DataOp, FpInsn};
use rsemu::cpu::arm::v7m::isa::{Insn, MemOffset, decode};

use super::state::{Difference, Place, State};

/// `CFSR` bits (B3.2.15).
const IACCVIOL: u32 = 1 << 0;
const IBUSERR: u32 = 1 << 8;
const UNDEFINSTR: u32 = 1 << 16;
const INVSTATE: u32 = 1 << 17;
const NOCP: u32 = 1 << 19;
/// Bits of `FPSCR` (A2.5.3): all of them; alternative half precision, flush to zero; input denormal, inexact, underflow.
const FPSCR_BITS: u32 = 0xF7C0_009F;
const FPSCR_AHP: u32 = 1 << 26;
const FPSCR_FZ: u32 = 1 << 24;
const FPSCR_IDC: u32 = 1 << 7;
const FPSCR_IXC: u32 = 1 << 4;
const FPSCR_UFC: u32 = 1 << 3;
/// `BASEPRI`: bits of a priority that the part does not have.
const PRIORITY_NOT_THERE: u32 = 0x0F;
/// `xPSR`: Thumb state, and the state of an IT block.
const T: u32 = 1 << 24;
const IT: u32 = 0x0600_FC00;
/// The program counter among the registers.
const PC: u32 = 15;
/// HardFault: every fault here.
const HARD_FAULT: u32 = 3;
/// Where nothing is executed (B3.1): peripherals, devices, the system.
const NEVER_EXECUTED: [std::ops::RangeInclusive<u32>; 2] =
    [0x4000_0000..=0x5FFF_FFFF, 0xA000_0000..=0xFFFF_FFFF];
/// The alias of the bit-band region of memory (B3.1).
const BIT_BAND: std::ops::Range<u32> = 0x2200_0000..0x2400_0000;
/// The processor's own bus.
const PRIVATE_BUS: std::ops::Range<u32> = 0xE000_0000..0xE010_0000;
/// Of a single: sign, infinity, the bit of a quiet NaN.
const SIGN: u32 = 1 << 31;
const INFINITY: u32 = 0x7F80_0000;
const QUIET: u32 = 1 << 22;

/// An exception's frame (B1.5.6): offsets of what it holds beside R0 to R3.
mod frame {
    pub const R12: u32 = 16;
    pub const LR: u32 = 20;
    pub const PC: u32 = 24;
    pub const XPSR: u32 = 28;
}

/// The instruction after which both cores differ for the first time.
pub struct Parting<'a> {
    /// Its halfwords.
    pub code: [u16; 2],
    /// Its address.
    pub at: u32,
    /// Both cores before it.
    pub before: &'a State,
    /// The virtual board's core and the second emulator's after it.
    pub board: &'a State,
    pub witness: &'a State,
    /// All differences.
    pub differences: &'a [Difference],
    /// The address of the last LDREX, if no STREX or exception came since.
    pub tagged: Option<u32>,
    /// Words of the board's memory after it.
    pub word: &'a dyn Fn(u32) -> Option<u32>,
}

/// A kind of difference.
type Rule = (fn(&Parting<'_>) -> bool, &'static str);

const RULES: [Rule; 13] = [
    (
        abandoned_load,
        "registers of an LDM after a fault: the instruction is abandoned, its base is as before (B1.5.10)",
    ),
    (
        even_target,
        "PC and T in the frame after a branch to an even address: the fault is the next instruction's (A2.3.1)",
    ),
    (
        even_target_interrupted,
        "an interrupt between a branch to an even address and the fault, which is the next instruction's (A2.3.1)",
    ),
    (never_executed, "CFSR after a fetch from where nothing is executed (B3.1): IACCVIOL, not IBUSERR"),
    (
        undefined_coprocessor,
        "CFSR after an undefined instruction in the coprocessors' space (A5.3.18): UNDEFINSTR, not NOCP",
    ),
    (
        exclusive,
        "STREX to another address than that of the LDREX before it (A3.4.1: left to the implementation)",
    ),
    (
        bit_band,
        "an access to a bit-band alias that is not aligned, or behind the memory it stands for (left open)",
    ),
    (
        private_bus,
        "an access to a part of the processor's own bus that one of them does not have (left open)",
    ),
    (basepri, "bits of BASEPRI that the part does not have: zero (B1.4.3)"),
    (alternative_half, "FPSCR.AHP: can be written (A2.5.3)"),
    (inexact_underflow, "FPSCR.IXC when a result is flushed to zero: underflow alone (A2.5.2)"),
    (denormal_beside_nan, "FPSCR.IDC when an operand is flushed to zero and another is a NaN: set (A2.5.2)"),
    (subtracted_nan, "the sign of a NaN that VSUB hands on: the operand's (A2.7.2)"),
];

/// Why the two may differ so, if it is known.
pub fn known(parting: &Parting<'_>) -> Option<&'static str> {
    RULES.iter().find(|(is_it, _)| is_it(parting)).map(|(_, reason)| *reason)
}

impl Parting<'_> {
    fn instruction(&self) -> Insn {
        decode(self.code[0], self.code[1])
    }

    /// Both are in the handler of a fault.
    fn faulted(&self) -> bool {
        [self.board, self.witness].iter().all(|it| it.exception() == HARD_FAULT)
    }

    /// The address of a part of the frame of the exception that has just been entered, on the main stack.
    fn framed(&self, offset: u32) -> Place {
        Place::Memory(self.board.r[13].wrapping_add(offset))
    }

    /// Where a register of thread mode may be seen after a fault: in itself, and in the frame.
    fn places(&self, register: u8) -> [Option<Place>; 2] {
        let framed = match register {
            0..=3 => Some(self.framed(4 * u32::from(register))),
            12 => Some(self.framed(frame::R12)),
            _ => None,
        };
        [Some(Place::R(register)), framed]
    }

    /// Exactly this register or word differs, and its values hold.
    fn only(&self, place: Place, holds: impl Fn(u32, u32) -> bool) -> bool {
        matches!(self.differences, [it] if it.place == place && holds(it.ours, it.theirs))
    }

    /// Every difference is one of these: place, ours, theirs.
    fn all(&self, expected: &[(Place, u32, u32)]) -> bool {
        let is_expected = |it: &Difference| expected.contains(&(it.place, it.ours, it.theirs));
        !self.differences.is_empty() && self.differences.iter().all(is_expected)
    }

    /// Where a branch to an address in a register or in memory leads, and its link.
    fn branch(&self) -> Option<(u32, Option<u32>)> {
        match self.instruction() {
            Insn::Bx { rm } => Some((self.before.r[usize::from(rm)], None)),
            Insn::Blx { rm } => Some((self.before.r[usize::from(rm)], Some((self.at + 2) | 1))),
            // The last of the list.
            Insn::LoadStoreMultiple { load: true, list, .. } if list >> PC != 0 => {
                let last = 4 * (list.count_ones() - 1);
                Some(((self.word)(self.access()?.0.wrapping_add(last))?, None))
            }
            _ => None,
        }
    }

    /// The first address that a load or store accesses, bytes of each access, and the register that a load of one writes.
    fn access(&self) -> Option<(u32, u32, Option<u8>)> {
        let r = |number: u8| self.before.r[usize::from(number)];
        let by = |base: u32, offset: u32, add: bool| {
            if add { base.wrapping_add(offset) } else { base.wrapping_sub(offset) }
        };
        match self.instruction() {
            Insn::LoadStore { load, size, rt, rn, offset, index, add, .. } => {
                let offset = match offset {
                    MemOffset::Imm(offset) => offset,
                    MemOffset::Reg { rm, lsl } => r(rm) << lsl,
                };
                let address = if index { by(r(rn), offset, add) } else { r(rn) };
                Some((address, size.bytes(), load.then_some(rt)))
            }
            Insn::LoadStoreDual { rn, imm, index, add, .. } => {
                Some((if index { by(r(rn), imm, add) } else { r(rn) }, 4, None))
            }
            Insn::LoadStoreMultiple { rn, list, before, .. } => {
                let length = 4 * list.count_ones();
                Some((if before { r(rn).wrapping_sub(length) } else { r(rn) }, 4, None))
            }
            Insn::LoadStoreExclusive { rn, imm, size, .. } => {
                Some((r(rn).wrapping_add(imm), size.bytes(), None))
            }
            _ => None,
        }
    }
}

/// `rsemu` has written the base back before the loads, and keeps what it has loaded; the second emulator has everything as
/// before. The manual wants that of the base, and leaves the other registers of the list open.
fn abandoned_load(it: &Parting<'_>) -> bool {
    let Insn::LoadStoreMultiple { load: true, rn, list, before, .. } = it.instruction() else { return false };
    let r = |number: u8| it.before.r[usize::from(number)];
    let length = 4 * list.count_ones();
    let (start, end) = if before {
        (r(rn).wrapping_sub(length), r(rn).wrapping_sub(length))
    } else {
        (r(rn), r(rn).wrapping_add(length))
    };
    let loaded = (0..15u8)
        .filter(|number| list >> number & 1 != 0)
        .zip(0..)
        .filter_map(|(number, nth)| (it.word)(start.wrapping_add(4 * nth)).map(|value| (number, value)));
    let expected: Vec<_> = loaded
        .chain([(rn, end)])
        .flat_map(|(number, ours)| {
            it.places(number).into_iter().flatten().map(move |place| (place, ours, r(number)))
        })
        .collect();
    it.faulted() && it.all(&expected)
}

/// `rsemu` faults at the branch; the manual has the target as the address of the fault, its T bit clear, and the branch done.
fn even_target(it: &Parting<'_>) -> bool {
    let Some((target, link)) = it.branch() else { return false };
    let both = [it.board, it.witness].iter().all(|it| it.cfsr & INVSTATE != 0);
    let status = (it.word)(it.board.r[13].wrapping_add(frame::XPSR)).unwrap_or_default();
    let mut expected =
        vec![(it.framed(frame::PC), it.at, target), (it.framed(frame::XPSR), status, status & !(T | IT))];
    expected.extend(link.map(|link| (it.framed(frame::LR), it.before.r[14], link)));
    it.faulted() && both && target & 1 == 0 && status & T != 0 && it.all(&expected)
}

/// The same, and an interrupt comes between the branch and the fault: `rsemu` has faulted, the second emulator has not yet.
fn even_target_interrupted(it: &Parting<'_>) -> bool {
    let Some((target, link)) = it.branch() else { return false };
    let (before, board) = (it.before, it.board);
    let mut branched = before.clone();
    branched.r[15] = target;
    branched.r[14] = link.unwrap_or(before.r[14]);
    branched.xpsr &= !(T | IT);
    let [r0, r1, r2, r3, .., r12, _, lr, _] = before.r;
    let framed = [r0, r1, r2, r3, r12, lr, it.at];
    let is_framed = framed
        .iter()
        .zip(0..)
        .all(|(value, nth)| (it.word)(board.r[13].wrapping_add(4 * nth)) == Some(*value));
    let is_in_frame = |difference: &Difference| match difference.place {
        Place::Memory(address) => address.wrapping_sub(board.r[13]) <= frame::XPSR,
        _ => true,
    };
    target & 1 == 0
        && it.witness == &branched
        && board.exception() == HARD_FAULT
        && board.cfsr == INVSTATE
        && (board.r[..13] == before.r[..13] && board.s == before.s)
        && is_framed
        && it.differences.iter().all(is_in_frame)
}

fn never_executed(it: &Parting<'_>) -> bool {
    let fetched = (it.word)(it.board.r[13].wrapping_add(frame::PC));
    let is_never = |address: u32| NEVER_EXECUTED.iter().any(|range| range.contains(&address));
    it.faulted()
        && fetched.is_some_and(is_never)
        && it.only(Place::Cfsr, |ours, theirs| ours == IBUSERR && theirs == IACCVIOL)
}

/// The table gives no instruction for 00000x and 11xxxx in the bits 20 to 25; coprocessors 10 and 11, the floating-point unit,
/// are there, so that an encoding that they lack is undefined. Of any other coprocessor NOCP is right.
fn undefined_coprocessor(it: &Parting<'_>) -> bool {
    let Insn::Coproc { cp } = it.instruction() else { return false };
    let operation = it.code[0] >> 4 & 0x3F;
    let is_undefined = operation < 2 || operation >= 0x30 || matches!(cp, 10 | 11);
    it.faulted() && is_undefined && it.only(Place::Cfsr, |ours, theirs| ours == NOCP && theirs == UNDEFINSTR)
}

/// A Cortex-M4's monitor has no address: it stores, as the second emulator does.
fn exclusive(it: &Parting<'_>) -> bool {
    let Insn::LoadStoreExclusive { load: false, rd, rt, .. } = it.instruction() else { return false };
    let Some((address, 4, _)) = it.access() else { return false };
    let kept = (it.word)(address).unwrap_or_default();
    let expected = [(Place::R(rd), 1, 0), (Place::Memory(address), kept, it.before.r[usize::from(rt)])];
    let is_refused = it.differences.iter().any(|difference| difference.place == Place::R(rd));
    let goes_on = [it.board, it.witness].iter().all(|core| core.exception() == it.before.exception());
    let is_stored = goes_on && is_refused && it.all(&expected);
    // Where there is no memory, the one that stores faults.
    let mut refused = it.before.r;
    refused[usize::from(rd)] = 1;
    let has_faulted = it.board.r[..15] == refused[..15]
        && it.board.s == it.before.s
        && it.board.exception() == it.before.exception()
        && it.witness.bfar == address
        && it.witness.exception() == HARD_FAULT
        && (it.word)(address).is_none();
    it.tagged.is_some_and(|tagged| tagged != address) && (is_stored || has_faulted)
}

/// One of the two faults, at an address in the alias.
fn bit_band(it: &Parting<'_>) -> bool {
    faults_once(it, |bfar| BIT_BAND.contains(&bfar))
        && it.access().is_some_and(|(address, bytes, _)| {
            // A word of the alias is a bit of the region.
            let stands_for = 0x2000_0000 + address.wrapping_sub(BIT_BAND.start) / 32;
            let is_unaligned = address % 4 + bytes > 4 || address % bytes != 0;
            BIT_BAND.contains(&address) && (is_unaligned || (it.word)(stands_for & !3).is_none())
        })
}

/// A load of another value, or a fault of one of the two.
fn private_bus(it: &Parting<'_>) -> bool {
    let Some((address, _, loaded)) = it.access() else { return false };
    let is_value = loaded.is_some_and(|rt| it.only(Place::R(rt), |_, _| true));
    PRIVATE_BUS.contains(&address) && (is_value || faults_once(it, |bfar| PRIVATE_BUS.contains(&bfar)))
}

/// Only one of the two has faulted, with this address.
fn faults_once(it: &Parting<'_>, is_there: impl Fn(u32) -> bool) -> bool {
    match [it.board, it.witness].map(|core| core.exception() == HARD_FAULT) {
        [true, false] => is_there(it.board.bfar),
        [false, true] => is_there(it.witness.bfar),
        _ => false,
    }
}

fn basepri(it: &Parting<'_>) -> bool {
    let Insn::Msr { rn, .. } = it.instruction() else { return false };
    let written = it.before.r[usize::from(rn)] & 0xFF;
    it.only(Place::Basepri, |ours, theirs| ours == written && theirs == written & !PRIORITY_NOT_THERE)
}

fn alternative_half(it: &Parting<'_>) -> bool {
    let Insn::Fp(FpInsn::Sys { to_core: false, rt, .. }) = it.instruction() else { return false };
    let written = it.before.r[usize::from(rt)] & FPSCR_BITS;
    it.only(Place::Fpscr, |ours, theirs| theirs == written && ours == written & !FPSCR_AHP)
}

fn inexact_underflow(it: &Parting<'_>) -> bool {
    matches!(it.instruction(), Insn::Fp(FpInsn::Data { .. }))
        && it.only(Place::Fpscr, |ours, theirs| {
            theirs & FPSCR_FZ != 0 && theirs & FPSCR_UFC != 0 && ours == theirs | FPSCR_IXC
        })
}

fn denormal_beside_nan(it: &Parting<'_>) -> bool {
    let Insn::Fp(FpInsn::Data { op: DataOp::Fma | DataOp::Fms | DataOp::Fnma | DataOp::Fnms, d, n, m }) =
        it.instruction()
    else {
        return false;
    };
    let operands = [d, n, m].map(|number| it.before.s[usize::from(number)]);
    operands.into_iter().any(is_denormal)
        && operands.into_iter().any(is_nan)
        && it.only(Place::Fpscr, |ours, theirs| {
            theirs & FPSCR_FZ != 0 && ours & FPSCR_IDC == 0 && theirs == ours | FPSCR_IDC
        })
}

/// `rsemu` subtracts by adding the negated operand, and so hands on a negated NaN.
fn subtracted_nan(it: &Parting<'_>) -> bool {
    let Insn::Fp(FpInsn::Data { op: DataOp::Sub, d, m, .. }) = it.instruction() else { return false };
    let operand = it.before.s[usize::from(m)];
    is_nan(operand) && it.only(Place::S(d), |ours, theirs| theirs == operand | QUIET && ours == theirs ^ SIGN)
}

fn is_nan(single: u32) -> bool {
    single & !SIGN > INFINITY
}

fn is_denormal(single: u32) -> bool {
    single & INFINITY == 0 && single & !SIGN != 0
}

#[cfg(test)]
mod tests;
