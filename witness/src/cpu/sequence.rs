//! Random sequences of Thumb-2 instructions, and the registers and memory that they begin with.
//!
//! Instructions are made class by class from the encodings of ARM DDI 0403 chapter A7, by chance in every field, but without
//! those that the manual makes UNPREDICTABLE: there two cores may differ. Branches go forward to an instruction of the
//! sequence. Some pointers lead nowhere, so that faults occur.

use super::chance::Chance;
use super::layout::{SHORT_FLASH, SHORT_RAM};
use super::state::State;

/// Instructions of a sequence.
pub const LENGTH: usize = 12;
/// Where sequences begin: constants lie on both sides.
pub const BEGIN: u32 = SHORT_FLASH.base + 0x400;
/// `NOP`: what a sequence is followed by.
const NOP: u16 = 0xBF00;

/// `xPSR`: Thumb state.
const T: u32 = 1 << 24;

/// A sequence.
#[derive(Clone, Debug)]
pub struct Sequence {
    /// Halfwords from [`BEGIN`] on.
    code: Vec<u16>,
}

/// An instruction; a branch does not know yet how far it goes.
#[derive(Clone, Copy)]
enum Piece {
    Narrow(u16),
    Wide(u32),
    /// `B<c>` of 16 bits, `CBZ` and `CBNZ`, `B<c>.W`, `B.W`, `BL`.
    Conditional(u16),
    Compare(u16),
    WideConditional(u32),
    Wide26(u32),
    Branch,
}

impl Piece {
    fn halves(self) -> usize {
        match self {
            Piece::Narrow(_) | Piece::Conditional(_) | Piece::Compare(_) | Piece::Branch => 1,
            Piece::Wide(_) | Piece::WideConditional(_) | Piece::Wide26(_) => 2,
        }
    }
}

impl Sequence {
    /// One by chance.
    pub fn new(chance: &mut Chance) -> Sequence {
        let mut pieces = Vec::new();
        while pieces.len() < LENGTH {
            match chance.below(12) {
                0 => it_block(chance, &mut pieces),
                1 => pieces.push(branch(chance)),
                _ => pieces.push(instruction(chance, false)),
            }
        }
        let mut offsets = Vec::new();
        let mut at = 0;
        for piece in &pieces {
            offsets.push(at);
            at += piece.halves();
        }
        let mut code = Vec::new();
        for (number, piece) in pieces.iter().enumerate() {
            // Behind the block that it may be in: into a block would be UNPREDICTABLE.
            // CBZ does not reach the next instruction: its distances begin at its own address and four.
            let nearest = offsets[number] + 2 * usize::from(matches!(piece, Piece::Compare(_)));
            let reached = |to: &usize| !in_block(&pieces, *to) && offsets[*to] >= nearest;
            let behind = (number + 1..pieces.len()).find(reached).map_or(at.max(nearest), |to| offsets[to]);
            let distance = behind as i32 - offsets[number] as i32 - 2;
            encode(*piece, distance, &mut code);
        }
        code.resize(code.len() + 2 * LENGTH, NOP);
        Sequence { code }
    }

    /// Its halfwords.
    pub fn into_halves(self) -> Vec<u16> {
        self.code
    }

    /// Its bytes.
    pub fn bytes(&self) -> Vec<u8> {
        self.code.iter().flat_map(|half| half.to_le_bytes()).collect()
    }
}

/// Whether the instruction is in an IT block, or the first behind one that still belongs to it.
fn in_block(pieces: &[Piece], number: usize) -> bool {
    (number.saturating_sub(4)..number).any(|it| match pieces[it] {
        Piece::Narrow(half) if half & 0xff00 == 0xbf00 && half & 0xf != 0 => {
            number - it <= 4 - (half & 0xf).trailing_zeros() as usize
        }
        _ => false,
    })
}

fn encode(piece: Piece, distance: i32, code: &mut Vec<u16>) {
    let halfwords = distance as u32;
    match piece {
        Piece::Narrow(half) => code.push(half),
        Piece::Wide(word) => code.extend([(word >> 16) as u16, word as u16]),
        Piece::Conditional(half) => code.push(half | (halfwords & 0xff) as u16),
        Piece::Compare(half) => {
            let far = halfwords.min(63) as u16;
            code.push(half | (far & 0x20) << 4 | (far & 0x1f) << 3);
        }
        Piece::Branch => code.push(0xE000 | (halfwords & 0x7ff) as u16),
        Piece::WideConditional(word) => {
            let word =
                word | (halfwords >> 11 & 0x3f) << 16 | halfwords & 0x7ff | sign(distance) * 0x0400_2800;
            code.extend([(word >> 16) as u16, word as u16]);
        }
        Piece::Wide26(word) => {
            // J1 and J2 are the inverse of the exclusive or with the sign: both 1 for short distances.
            let word =
                word | (halfwords >> 11 & 0x3ff) << 16 | halfwords & 0x7ff | sign(distance) << 26 | 0x2800;
            code.extend([(word >> 16) as u16, word as u16]);
        }
    }
}

fn sign(distance: i32) -> u32 {
    u32::from(distance < 0)
}

fn branch(c: &mut Chance) -> Piece {
    match c.below(6) {
        0 | 1 => Piece::Conditional((0xD000 | c.below(14) << 8) as u16),
        2 => Piece::Compare((0xB100 | c.below(2) << 11 | c.below(8)) as u16),
        3 => Piece::WideConditional(0xF000_8000 | c.below(14) << 22),
        4 => Piece::Wide26(0xF000_9000 | c.below(2) << 14),
        _ => Piece::Branch,
    }
}

fn it_block(c: &mut Chance, pieces: &mut Vec<Piece>) {
    let condition = c.below(14);
    // No "else" after "always".
    let mask = 1 + c.below(15);
    let length = 4 - mask.trailing_zeros();
    pieces.push(Piece::Narrow((0xBF00 | condition << 4 | mask) as u16));
    for _ in 0..length {
        pieces.push(instruction(c, true));
    }
}

/// A register for data; seldom one of the pointers, so that these stay pointers.
fn r(c: &mut Chance) -> u32 {
    if c.once_in(32) { pointer(c) } else { c.of(&[0, 1, 2, 3, 9, 10, 12, 14]) }
}

/// A register that begins as a pointer.
fn pointer(c: &mut Chance) -> u32 {
    c.of(&POINTERS)
}

/// Registers that begin as pointers into RAM.
const POINTERS: [u32; 6] = [4, 5, 6, 7, 8, 11];

/// A narrow instruction whose field at `at` names a register to be written: one for data.
fn writes(half: u32, at: u32) -> u32 {
    half & !(4 << at)
}

/// A narrow instruction whose field at `at` names a pointer.
fn points(half: u32, at: u32) -> u32 {
    half | 4 << at
}

/// Another one than `not`.
fn other(c: &mut Chance, not: u32) -> u32 {
    loop {
        let register = r(c);
        if register != not {
            return register;
        }
    }
}

fn instruction(c: &mut Chance, in_it: bool) -> Piece {
    match c.below(8) {
        0..=2 => Piece::Narrow(narrow(c, in_it) as u16),
        3 => Piece::Wide(wide_memory(c)),
        4 => Piece::Wide(floats(c)),
        5 => Piece::Wide(wide_multiply(c)),
        _ => Piece::Wide(wide_data(c, in_it)),
    }
}

fn narrow(c: &mut Chance, in_it: bool) -> u32 {
    match c.below(22) {
        // A shift by a constant; LSL by 0 is a move, which sets flags and cannot be in a block.
        0 => writes(0x0040 + c.below(0x17C0), 0),
        1 => writes(0x1800 + c.below(0x0800), 0),
        2 | 3 => writes(0x2000 + c.below(0x2000), 8),
        4 | 5 => writes(0x4000 + c.below(0x0400), 0),
        // ADD, CMP, MOV of any registers.
        6 => {
            let (op, d, m) = (c.of(&[0, 2]), r(c), r(c));
            0x4400 | op << 8 | (d & 8) << 4 | m << 3 | d & 7
        }
        7 => {
            let (n, m) = (8 + c.below(5), r(c));
            0x4500 | (n & 8) << 4 | m << 3 | n & 7
        }
        8 => writes(0x4800 + c.below(0x0800) & 0xff3f, 8),
        // With an offset in a register, which is seldom small.
        9 if c.once_in(4) => writes(points(0x5000 + c.below(0x1000), 3), 0),
        9..=12 => writes(points(0x6000 + c.below(0x3000), 3), 0),
        13 => writes(0x9000 + c.below(0x1000) & 0xff1f, 8),
        14 => writes(0xA000 + c.below(0x1000), 8),
        15 => 0xB000 | c.below(2) << 7 | c.below(16),
        16 => writes(0xB200 | c.below(256), 0),
        17 => writes(0xBA00 | c.of(&[0, 1, 3]) << 6 | c.below(64), 0),
        // PUSH, with or without LR; POP without PC.
        18 => 0xB400 | c.below(2) << 8 | 1 + c.below(255),
        19 => 0xBC00 | 1 + c.below(15),
        // STM and LDM, with the base not in the list.
        20 => {
            let (n, load) = (4 + c.below(4), c.below(2));
            let list = c.below(256) & !(1 << n) & if load == 1 { 0xf } else { 0xff };
            0xC000 | load << 11 | n << 8 | if list == 0 { 1 } else { list }
        }
        _ if in_it || !c.once_in(4) => NOP.into(),
        // CPSIE, CPSID of PRIMASK; SVC; UDF; BX to where it may lead.
        _ => c.of(&[0xB662, 0xB672, 0xB662, 0xB662, 0xDF00, 0xDE00, 0x4770]),
    }
}

fn wide_data(c: &mut Chance, in_it: bool) -> u32 {
    let (d, n, m) = (r(c), r(c), r(c));
    match c.below(20) {
        // A constant: AND BIC ORR ORN EOR ADD ADC SBC SUB RSB; 0 in some of its forms is UNPREDICTABLE.
        0..=3 => {
            let op = c.of(&[0, 1, 2, 3, 4, 8, 10, 11, 13, 14]);
            0xF000_0000 | op << 21 | constant(c) | c.below(2) << 20 | n << 16 | d << 8
        }
        // MOV, MVN.
        4 => 0xF000_0000 | c.of(&[2, 3]) << 21 | constant(c) | c.below(2) << 20 | 15 << 16 | d << 8,
        // TST, TEQ, CMN, CMP.
        5 => 0xF010_0F00 | c.of(&[0, 4, 8, 13]) << 21 | constant(c) | n << 16,
        // With a shifted register.
        6..=8 => {
            let op = c.of(&[0, 1, 2, 3, 4, 8, 10, 11, 13, 14]);
            0xEA00_0000
                | op << 21
                | c.below(2) << 20
                | n << 16
                | c.below(8) << 12
                | d << 8
                | c.below(16) << 4
                | m
        }
        9 => 0xEA10_0F00 | c.of(&[0, 4, 8, 13]) << 21 | n << 16 | c.below(8) << 12 | c.below(16) << 4 | m,
        10 => {
            0xEA4F_0000
                | c.below(2) << 21
                | c.below(2) << 20
                | c.below(8) << 12
                | d << 8
                | c.below(16) << 4
                | m
        }
        // PKHBT, PKHTB.
        11 => 0xEAC0_0000 | n << 16 | c.below(8) << 12 | d << 8 | c.below(4) << 6 | c.below(2) << 5 | m,
        // ADDW, SUBW, MOVW, MOVT.
        12 => {
            let op = c.of(&[0xF200_0000, 0xF2A0_0000]);
            op | n << 16 | d << 8 | c.next() & 0x0400_70FF
        }
        13 => c.of(&[0xF240_0000, 0xF2C0_0000]) | d << 8 | c.next() & 0x040F_70FF,
        // SBFX, UBFX; BFI, BFC.
        14 => {
            let lsb = c.below(32);
            let width = 1 + c.below(32 - lsb);
            let field = (lsb >> 2) << 12 | (lsb & 3) << 6;
            match c.below(3) {
                0 => 0xF340_0000 | n << 16 | d << 8 | field | (width - 1),
                1 => 0xF3C0_0000 | n << 16 | d << 8 | field | (width - 1),
                _ => 0xF360_0000 | c.of(&[n, 15]) << 16 | d << 8 | field | (lsb + width - 1),
            }
        }
        // SSAT, USAT; SSAT16, USAT16.
        15 => match c.below(3) {
            2 => c.of(&[0xF320_0000, 0xF3A0_0000]) | n << 16 | d << 8 | c.below(16),
            _ => {
                // ASR by 0 would be the one above.
                let shift = 1 + c.below(31);
                let field = (shift >> 2) << 12 | (shift & 3) << 6 | c.below(2) << 21;
                c.of(&[0xF300_0000, 0xF380_0000]) | n << 16 | d << 8 | field | c.below(32)
            }
        },
        // Shifts by a register; extensions, with and without an addition.
        16 => 0xFA00_F000 | c.below(8) << 20 | n << 16 | d << 8 | m,
        17 => 0xFA00_F080 | c.below(6) << 20 | c.of(&[n, 15]) << 16 | d << 8 | c.below(4) << 4 | m,
        // Parallel additions, saturating ones, SEL, CLZ, REV, RBIT.
        18 => match c.below(4) {
            0 | 1 => {
                let (op1, op2) = (c.of(&[0, 1, 2, 4, 5, 6]), c.of(&[0, 1, 2, 4, 5, 6]));
                0xFA80_F000 | op1 << 20 | n << 16 | d << 8 | op2 << 4 | m
            }
            2 => 0xFA80_F080 | n << 16 | d << 8 | c.below(4) << 4 | m,
            _ => match c.below(3) {
                0 => 0xFAA0_F080 | n << 16 | d << 8 | m,
                1 => 0xFAB0_F080 | m << 16 | d << 8 | m,
                _ => 0xFA90_F080 | m << 16 | d << 8 | c.below(4) << 4 | m,
            },
        },
        _ => system(c, d, n, in_it),
    }
}

/// The twelve bits of a modified constant (A5.3.2) without the forms that cannot be 0.
fn constant(c: &mut Chance) -> u32 {
    let bits = c.next() & 0x0400_70FF;
    if bits & 0xff == 0 { bits | 1 } else { bits }
}

fn system(c: &mut Chance, d: u32, n: u32, in_it: bool) -> u32 {
    match c.below(9) {
        // MRS of APSR, IAPSR, EAPSR, XPSR, IPSR, EPSR, IEPSR, MSP, PSP, PRIMASK, BASEPRI, FAULTMASK, CONTROL.
        0..=2 => 0xF3EF_8000 | d << 8 | c.of(&[0, 1, 2, 3, 5, 6, 7, 8, 9, 16, 17, 19, 20]),
        // MSR of APSR: flags, GE, both.
        3 | 4 => 0xF380_8000 | n << 16 | c.of(&[1, 2, 3]) << 10,
        // Of PSP, PRIMASK, BASEPRI, BASEPRI_MAX.
        5 => 0xF380_8800 | n << 16 | c.of(&[9, 16, 17, 18]),
        6 => c.of(&[0xF3BF_8F4F, 0xF3BF_8F5F, 0xF3BF_8F6F, 0xF3BF_8F2F, 0xF3AF_8000]),
        // LDREX, STREX.
        7 => 0xE850_0F00 | pointer(c) << 16 | d << 12 | c.below(64),
        _ if in_it => 0xF3AF_8000,
        _ => {
            let status = loop {
                let status = other(c, n);
                if status != d {
                    break status;
                }
            };
            0xE840_0000 | n << 16 | d << 12 | status << 8 | c.below(64)
        }
    }
}

fn wide_multiply(c: &mut Chance) -> u32 {
    let (d, n, m, a) = (r(c), r(c), r(c), r(c));
    let regs = n << 16 | d << 8 | m;
    let or_none = c.of(&[a, 15]) << 12;
    match c.below(12) {
        0 => 0xFB00_0000 | regs | or_none,
        1 => 0xFB00_0010 | regs | a << 12,
        2 => 0xFB10_0000 | regs | or_none | c.below(4) << 4,
        3 => 0xFB20_0000 | regs | or_none | c.below(2) << 4,
        4 => 0xFB30_0000 | regs | or_none | c.below(2) << 4,
        5 => 0xFB40_0000 | regs | or_none | c.below(2) << 4,
        6 => 0xFB50_0000 | regs | or_none | c.below(2) << 4,
        7 => 0xFB60_0000 | regs | a << 12 | c.below(2) << 4,
        8 => 0xFB70_0000 | regs | or_none,
        9 => c.of(&[0xFB90_F0F0, 0xFBB0_F0F0]) | regs,
        // SMULL, UMULL, SMLAL, SMLALxy, SMLALD, SMLSLD, UMLAL, UMAAL.
        _ => {
            let op = c.of(&[
                0xFB80_0000,
                0xFBA0_0000,
                0xFBC0_0000,
                0xFBC0_0080,
                0xFBC0_0090,
                0xFBC0_00A0,
                0xFBC0_00B0,
                0xFBC0_00C0,
                0xFBC0_00D0,
                0xFBD0_00C0,
                0xFBD0_00D0,
                0xFBE0_0000,
                0xFBE0_0060,
            ]);
            op | regs | other(c, d) << 12
        }
    }
}

fn wide_memory(c: &mut Chance) -> u32 {
    let n = pointer(c);
    let t = other(c, n);
    // STRB, LDRB, STRH, LDRH, STR, LDR, LDRSB, LDRSH.
    let op = c.of(&[
        0xF800_0000,
        0xF810_0000,
        0xF820_0000,
        0xF830_0000,
        0xF840_0000,
        0xF850_0000,
        0xF910_0000,
        0xF930_0000,
    ]);
    match c.below(12) {
        0..=2 => op | 1 << 23 | n << 16 | t << 12 | c.next() & c.of(&[0xFFF, 0x3F, 0x3C, 0x3C]),
        // Negative offset; before or after, with writing back.
        3..=5 => op | n << 16 | t << 12 | 0x800 | c.of(&[4, 1, 3, 5, 7]) << 8 | c.below(256),
        6 => op | n << 16 | t << 12 | c.below(4) << 4 | r(c),
        // LDR of a constant.
        7 => {
            (op & 0xFF50_0000 | 0x0010_0000) & !(1 << 23)
                | c.below(2) << 23
                | 15 << 16
                | t << 12
                | c.below(64)
        }
        // LDRD, STRD: offset, before, after.
        8 | 9 => {
            let second = loop {
                let second = other(c, n);
                if second != t {
                    break second;
                }
            };
            // P, U, W.
            let (p, u, w) = c.of(&[(1, 0, 0), (1, 1, 0), (1, 0, 1), (1, 1, 1), (0, 0, 1), (0, 1, 1)]);
            let load = c.below(2);
            0xE840_0000
                | p << 24
                | u << 23
                | w << 21
                | load << 20
                | n << 16
                | t << 12
                | second << 8
                | c.below(32)
        }
        // LDM, STM: after, before; two registers at least, without the base.
        _ => {
            let mut list: u32 = 0;
            while list.count_ones() < 2 {
                list |= c.next() & c.next() & 0x560F;
            }
            let op = c.of(&[0xE880_0000, 0xE8A0_0000, 0xE900_0000, 0xE920_0000]);
            op | c.below(2) << 20 | n << 16 | list
        }
    }
}

/// Floating point, single precision (ARM DDI 0403 A7.5).
fn floats(c: &mut Chance) -> u32 {
    let (d, n, m) = (c.below(32), c.below(32), c.below(32));
    let vd = (d >> 1) << 12 | (d & 1) << 22;
    let vn = (n >> 1) << 16 | (n & 1) << 7;
    let vm = (m >> 1) | (m & 1) << 5;
    let t = r(c);
    match c.below(16) {
        // VMLA, VMLS, VNMLS, VNMLA, VMUL, VNMUL, VADD, VSUB, VDIV, VFNMS, VFNMA, VFMA, VFMS.
        0..=4 => {
            let op = c.of(&[
                0xEE00_0A00,
                0xEE00_0A40,
                0xEE10_0A00,
                0xEE10_0A40,
                0xEE20_0A00,
                0xEE20_0A40,
                0xEE30_0A00,
                0xEE30_0A40,
                0xEE80_0A00,
                0xEE90_0A00,
                0xEE90_0A40,
                0xEEA0_0A00,
                0xEEA0_0A40,
            ]);
            op | vd | vn | vm
        }
        // VMOV, VABS, VNEG, VSQRT; VCMP, VCMPE, with 0 too.
        5 | 6 => c.of(&[0xEEB0_0A40, 0xEEB0_0AC0, 0xEEB1_0A40, 0xEEB1_0AC0]) | vd | vm,
        7 => c.of(&[0xEEB4_0A40, 0xEEB4_0AC0]) | vd | vm,
        8 => c.of(&[0xEEB5_0A40, 0xEEB5_0AC0]) | vd,
        // To and from integers.
        9 | 10 => {
            c.of(&[0xEEB8_0A40, 0xEEB8_0AC0, 0xEEBC_0A40, 0xEEBC_0AC0, 0xEEBD_0A40, 0xEEBD_0AC0]) | vd | vm
        }
        // VMOV of a constant; to and from a register; VMRS of the flags or all, VMSR.
        11 => 0xEEB0_0A00 | vd | c.next() & 0x000F_000F,
        12 | 13 => c.of(&[0xEE00_0A10, 0xEE10_0A10]) | vn | t << 12,
        14 => c.of(&[0xEEF1_FA10, 0xEEF1_0A10 | t << 12, 0xEEE1_0A10 | t << 12]),
        // VLDR, VSTR.
        _ => {
            c.of(&[0xED80_0A00, 0xED90_0A00, 0xED00_0A00, 0xED10_0A00]) | vd | pointer(c) << 16 | c.below(16)
        }
    }
}

/// Registers that a sequence begins with, in thread mode.
pub fn state(c: &mut Chance) -> State {
    let mut state = State::default();
    for (number, register) in (0..).zip(&mut state.r) {
        let is_pointer = POINTERS.contains(&number) && !c.once_in(40);
        *register = match c.below(10) {
            _ if is_pointer && !c.once_in(8) => SHORT_RAM.base + 0x800 + 4 * c.below(0x400),
            _ if is_pointer => SHORT_RAM.base + 0x800 + c.below(0x1000),
            0..=2 => SHORT_RAM.base + 0x800 + 4 * c.below(0x400),
            3 => SHORT_RAM.base + 0x800 + c.below(0x1000),
            4 | 5 => c.below(4096),
            6 => c.below(64),
            7 => c.of(&[0, 1, 0x7FFF_FFFF, 0x8000_0000, u32::MAX, BEGIN | 1, 0xF000_0000]),
            _ => c.next(),
        };
    }
    state.r[13] = SHORT_RAM.base + 0x1000 + 8 * c.below(64);
    state.r[15] = BEGIN;
    state.other_sp = SHORT_RAM.base + 0x1800 + 8 * c.below(64);
    state.xpsr = T | c.next() & 0xF80F_0000;
    for float in &mut state.s {
        *float = match c.below(8) {
            0 => c.of(&[
                0,
                0x8000_0000,
                0x7F80_0000,
                0xFF80_0000,
                0x7FC0_0000,
                0x7F80_0001,
                1,
                0x007F_FFFF,
                0x0080_0000,
            ]),
            1 => c.next(),
            // Between 2^-16 and 2^16.
            _ => c.next() & 0x807F_FFFF | (111 + c.below(32)) << 23,
        };
    }
    // A floating-point context in use: rounding, flush to zero, default NaN, the sticky flags; or none so far.
    if c.once_in(2) {
        state.control = 1 << 2;
        state.fpscr = if c.once_in(2) { c.next() & 0xF3C0_009F } else { 0 };
    }
    state
}

/// The RAM that a sequence begins with.
pub fn ram(c: &mut Chance) -> Vec<u8> {
    (0..SHORT_RAM.length / 4)
        .flat_map(|_| {
            let word = if c.once_in(4) { SHORT_RAM.base + c.below(SHORT_RAM.length) } else { c.next() };
            word.to_le_bytes()
        })
        .collect()
}
