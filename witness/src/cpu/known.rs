//! Differences that are known and decided: what the architecture manual says, and why nothing here depends on it.
//!
//! In each of them but three accesses that the manual leaves open, the second emulator is right and `rsemu` is wrong. `docs/witness.md` has the same list.

use super::state::{Difference, State};

/// `CFSR` bits (ARM DDI 0403 B3.2.15).
const IACCVIOL: u32 = 1 << 0;
const IBUSERR: u32 = 1 << 8;
const UNDEFINSTR: u32 = 1 << 16;
const INVSTATE: u32 = 1 << 17;
const NOCP: u32 = 1 << 19;
/// Bits of `FPSCR`: flush to zero; input denormal, inexact.
const FPSCR_FZ: u32 = 1 << 24;
const FPSCR_IDC: u32 = 1 << 7;
const FPSCR_IXC: u32 = 1 << 4;
/// Bit-band aliases (ARM DDI 0403 B3.1).
const BIT_BANDS: [std::ops::Range<u32>; 2] = [0x2200_0000..0x2400_0000, 0x4200_0000..0x4400_0000];
/// The processor's own bus.
const PRIVATE_BUS: std::ops::Range<u32> = 0xE000_0000..0xE010_0000;
/// Alternative half precision.
const FPSCR_AHP: u32 = 1 << 26;
const SIGN: u32 = 1 << 31;

/// Why the two may differ so after this instruction, if it is known. `base` is its base register before it, if it has one.
pub fn known(
    name: &str,
    base: Option<u32>,
    [board, witness]: [&State; 2],
    differences: &[Difference],
) -> Option<&'static str> {
    let is = |what: &str| differences.iter().all(|difference| difference.what == what);
    let faulted = board.exception() == 3;
    let is_at = |places: &std::ops::Range<u32>| [board, witness].iter().any(|it| places.contains(&it.bfar));
    let is_memory = |difference: &Difference| difference.what.starts_with('[');
    let is_float = |difference: &Difference| difference.what.starts_with('s') && difference.what.len() < 4;
    let cfsr = differences.iter().find(|difference| difference.what == "cfsr");
    if name == "LoadStoreMultiple"
        && faulted
        && differences.iter().all(|it| is_memory(it) || it.what.starts_with('r'))
    {
        return Some(
            "the base of LDM or STM after a fault: the instruction is abandoned, its registers are as before",
        );
    }
    if faulted
        && board.cfsr & INVSTATE != 0
        && (differences.iter().all(is_memory) || name == "Bx" || name == "Blx")
    {
        return Some(
            "PC and T in the frame after a branch to an even address: the fault is the next instruction's (A2.3.1)",
        );
    }
    if faulted && cfsr.is_some_and(|cfsr| cfsr.ours ^ cfsr.theirs == IACCVIOL | IBUSERR) && is("cfsr") {
        return Some("CFSR after a fetch from where nothing is executed (B3.1): IACCVIOL, not IBUSERR");
    }
    if name == "Coproc" && cfsr.is_some_and(|cfsr| cfsr.ours ^ cfsr.theirs == NOCP | UNDEFINSTR) && is("cfsr")
    {
        return Some("CFSR after an undefined instruction in the coprocessors' space: UNDEFINSTR, not NOCP");
    }
    if name == "LoadStoreExclusive"
        && !faulted
        && differences.iter().all(|it| is_memory(it) || it.what.starts_with('r'))
    {
        return Some(
            "STREX to another address than that of the LDREX before it (left to the implementation)",
        );
    }
    if BIT_BANDS.iter().any(is_at) {
        return Some(
            "an access across the words of a bit-band alias, or behind the memory it stands for (left open)",
        );
    }
    if is_at(&PRIVATE_BUS) || base.is_some_and(|base| PRIVATE_BUS.contains(&base)) {
        return Some(
            "an access to a part of the processor's own bus that one of them does not have (left open)",
        );
    }
    let differ_in = |bits: u32| differences.iter().all(|it| (it.ours ^ it.theirs) & !bits == 0);
    if is("basepri") && differ_in(0x0f) {
        return Some("bits of BASEPRI that the part does not have: zero");
    }
    if is("fpscr") && differ_in(FPSCR_AHP) {
        return Some("FPSCR.AHP: can be written");
    }
    if is("fpscr") && board.fpscr & FPSCR_FZ != 0 && differ_in(FPSCR_IXC) {
        return Some("FPSCR.IXC when a result is flushed to zero: underflow alone");
    }
    if is("fpscr") && board.fpscr & FPSCR_FZ != 0 && differ_in(FPSCR_IDC) {
        return Some("FPSCR.IDC when an operand is flushed to zero and another is a NaN: set");
    }
    let is_nan = |value: u32| value & 0x7fff_ffff > 0x7f80_0000;
    if name.starts_with("Fp")
        && differences.iter().all(|it| is_float(it) && is_nan(it.ours) && it.ours ^ it.theirs == SIGN)
    {
        return Some("the sign of a NaN that VSUB hands on: the operand's");
    }
    None
}
