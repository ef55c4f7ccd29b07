//! Each rule knows its own difference, and no other: a planted wrong result within an instruction that it allows is found.

use super::*;

/// Where the frame of an exception is.
const FRAME: u32 = 0x2000_1000;
/// Of a pointer, an instruction.
const POINTER: u32 = 0x2000_0400;
const AT: u32 = 0x0800_0410;
const TARGET: u32 = 0x2000_0100;

/// A difference that a rule knows.
struct Example {
    name: &'static str,
    code: [u16; 2],
    before: State,
    board: State,
    witness: State,
    differences: Vec<Difference>,
    tagged: Option<u32>,
    memory: Vec<(u32, u32)>,
    /// What differs may be anything.
    is_open: bool,
}

impl Example {
    fn new(name: &'static str, code: [u16; 2], differences: &[(Place, u32, u32)]) -> Example {
        let differences =
            differences.iter().map(|&(place, ours, theirs)| Difference { place, ours, theirs }).collect();
        Example {
            name,
            code,
            before: State::default(),
            board: State::default(),
            witness: State::default(),
            differences,
            tagged: None,
            memory: Vec::new(),
            is_open: false,
        }
    }

    /// Both have entered the handler of a fault.
    fn faulted(mut self) -> Example {
        for state in [&mut self.board, &mut self.witness] {
            (state.xpsr, state.r[13]) = (HARD_FAULT, FRAME);
        }
        self
    }

    fn with(mut self, change: impl FnOnce(&mut Example)) -> Example {
        change(&mut self);
        self
    }

    fn known(&self) -> Option<&'static str> {
        let word = |address| self.memory.iter().find(|(at, _)| *at == address).map(|(_, word)| *word);
        known(&Parting {
            code: self.code,
            at: AT,
            before: &self.before,
            board: &self.board,
            witness: &self.witness,
            differences: &self.differences,
            tagged: self.tagged,
            word: &word,
        })
    }
}

/// One of each rule; of some, several.
fn examples() -> Vec<Example> {
    const NAN: u32 = 0x7FC0_1234;
    const DENORMAL: u32 = 0x0000_0001;
    let branch =
        [(Place::Memory(FRAME + 24), AT, TARGET), (Place::Memory(FRAME + 28), 0x4100_0000, 0x4000_0000)];
    let with_link = [branch[0], branch[1], (Place::Memory(FRAME + 20), 0x0800_0001, AT + 3)];
    let even = |example: Example| {
        example.faulted().with(|it| {
            (it.before.r[1], it.before.r[14]) = (TARGET, 0x0800_0001);
            (it.board.cfsr, it.witness.cfsr) = (INVSTATE, INVSTATE);
            it.memory = vec![(FRAME + 28, 0x4100_0000)];
        })
    };
    let flushed = FPSCR_FZ | FPSCR_UFC;
    vec![
        Example::new(
            "LDM r4!, {r0, r1}, the second word is not there",
            [0xCC03, 0],
            &[(Place::R(0), 77, 5), (Place::R(4), POINTER + 8, POINTER), (Place::Memory(FRAME), 77, 5)],
        )
        .faulted()
        .with(|it| {
            (it.before.r[0], it.before.r[4]) = (5, POINTER);
            it.memory = vec![(POINTER, 77)];
        }),
        even(Example::new("BX r1", [0x4708, 0], &branch)),
        even(Example::new("BLX r1", [0x4788, 0], &with_link)),
        even(Example::new("POP {pc}", [0xBD00, 0], &branch)).with(|it| {
            it.before.r[13] = POINTER;
            it.memory.push((POINTER, TARGET));
        }),
        Example::new(
            "BX r1, and an interrupt",
            [0x4708, 0],
            &[(Place::R(15), 0x1FFF_0400, TARGET), (Place::Memory(FRAME + 24), AT, 0)],
        )
        .with(|it| {
            (it.before.r[1], it.before.xpsr) = (TARGET, T);
            it.witness = it.before.clone();
            (it.witness.r[15], it.witness.xpsr) = (TARGET, 0);
            it.board = it.before.clone();
            (it.board.r[13], it.board.xpsr, it.board.cfsr) = (FRAME, HARD_FAULT, INVSTATE);
            it.memory = (0..6).map(|nth| (FRAME + 4 * nth, 0)).collect();
            it.memory[1].1 = TARGET;
            it.memory.push((FRAME + 24, AT));
            it.is_open = true;
        }),
        Example::new("a fetch from a device", [0x4708, 0], &[(Place::Cfsr, IBUSERR, IACCVIOL)])
            .faulted()
            .with(|it| it.memory = vec![(FRAME + 24, 0xF000_0000)]),
        Example::new(
            "an undefined one of coprocessor 11",
            [0xEE00, 0x0B00],
            &[(Place::Cfsr, NOCP, UNDEFINSTR)],
        )
        .faulted(),
        Example::new("no operation of a coprocessor", [0xFF00, 0x0100], &[(Place::Cfsr, NOCP, UNDEFINSTR)])
            .faulted(),
        Example::new(
            "STREX r0, r1, [r4]",
            [0xE844, 0x1000],
            &[(Place::R(0), 1, 0), (Place::Memory(POINTER), 3, 9)],
        )
        .with(|it| {
            (it.before.r[1], it.before.r[4]) = (9, POINTER);
            it.tagged = Some(POINTER + 8);
            it.memory = vec![(POINTER, 3)];
        }),
        Example::new("STREX r0, r1, [r4] to no memory", [0xE844, 0x1000], &[(Place::R(0), 1, 0)]).with(
            |it| {
                it.before.r[4] = 0x0E00;
                it.board = it.before.clone();
                it.board.r[0] = 1;
                (it.witness.xpsr, it.witness.bfar) = (HARD_FAULT, 0x0E00);
                it.tagged = Some(POINTER);
                it.is_open = true;
            },
        ),
        Example::new("LDR r0, [r4] across words of an alias", [0x6820, 0], &[(Place::R(0), 1, 0)]).with(
            |it| {
                it.before.r[4] = BIT_BAND.start + 2;
                (it.board.xpsr, it.board.bfar) = (HARD_FAULT, BIT_BAND.start + 2);
                it.memory = vec![(0x2000_0000, 0)];
                it.is_open = true;
            },
        ),
        Example::new("LDRH r0, [r4] of an alias, not aligned", [0x8820, 0], &[(Place::R(0), 1, 0)]).with(
            |it| {
                it.before.r[4] = BIT_BAND.start + 1;
                (it.witness.xpsr, it.witness.bfar) = (HARD_FAULT, BIT_BAND.start + 1);
                it.memory = vec![(0x2000_0000, 0)];
                it.is_open = true;
            },
        ),
        Example::new("LDR r0, [r4] of a register of the core", [0x6820, 0], &[(Place::R(0), 1, 0)]).with(
            |it| {
                it.before.r[4] = 0xE000_1004;
                it.is_open = true;
            },
        ),
        Example::new("MSR BASEPRI, r1", [0xF381, 0x8811], &[(Place::Basepri, 0x87, 0x80)])
            .with(|it| it.before.r[1] = 0x1287),
        Example::new("VMSR FPSCR, r1", [0xEEE1, 0x1A10], &[(Place::Fpscr, 1, FPSCR_AHP | 1)])
            .with(|it| it.before.r[1] = FPSCR_AHP | 0x0800_0001),
        Example::new(
            "VMUL s0, s1, s2, flushed",
            [0xEE20, 0x0A81],
            &[(Place::Fpscr, flushed | FPSCR_IXC, flushed)],
        ),
        Example::new(
            "VFMA s0, s1, s2 of a denormal and a NaN",
            [0xEEA0, 0x0A81],
            &[(Place::Fpscr, FPSCR_FZ, FPSCR_FZ | FPSCR_IDC)],
        )
        .with(|it| (it.before.s[0], it.before.s[2]) = (NAN, DENORMAL)),
        Example::new("VSUB s0, s1, s2 of a NaN", [0xEE30, 0x0AC1], &[(Place::S(0), NAN ^ SIGN, NAN)])
            .with(|it| it.before.s[2] = NAN),
    ]
}

#[test]
fn each_rule_knows_its_difference() {
    let mut reasons: Vec<&str> =
        examples().iter().map(|it| it.known().unwrap_or_else(|| panic!("not known: {}", it.name))).collect();
    reasons.sort_unstable();
    reasons.dedup();
    assert_eq!(reasons.len(), RULES.len(), "{reasons:#?}");
}

/// A register, a word or a flag more that differs.
#[test]
fn a_difference_more_is_found() {
    let more = [Place::R(9), Place::S(7), Place::Memory(0x2000_0800), Place::Xpsr, Place::OtherSp];
    for example in examples() {
        // After a fault of one of the two, everything differs.
        if example.board.exception() != example.witness.exception() {
            continue;
        }
        for place in more {
            let planted = Example {
                differences: [example.differences.as_slice(), &[Difference { place, ours: 1, theirs: 2 }]]
                    .concat(),
                ..examples().into_iter().find(|it| it.name == example.name).expect("the same")
            };
            assert_eq!(planted.known(), None, "{} and {place}", example.name);
        }
    }
}

/// A wrong value where a difference is known.
#[test]
fn another_value_is_found() {
    for example in examples().iter().filter(|it| !it.is_open) {
        for number in 0..example.differences.len() {
            for bit in 0..32 {
                for is_ours in [true, false] {
                    let mut planted =
                        examples().into_iter().find(|it| it.name == example.name).expect("the same");
                    let value = &mut planted.differences[number];
                    *(if is_ours { &mut value.ours } else { &mut value.theirs }) ^= 1 << bit;
                    let is_same = value.ours == value.theirs;
                    assert!(is_same || planted.known().is_none(), "{} bit {bit}", example.name);
                }
            }
        }
    }
}

/// The same difference after another instruction: an addition of registers.
#[test]
fn another_instruction_is_found() {
    for example in examples() {
        // A fetch is no instruction's.
        if example.name == "a fetch from a device" {
            continue;
        }
        let name = example.name;
        let planted = example.with(|it| it.code = [0x1840, 0]);
        assert_eq!(planted.known(), None, "{name}");
    }
}

/// What a rule is about does not hold.
#[test]
fn another_cause_is_found() {
    let change = |name: &str, change: fn(&mut Example)| {
        let example = examples().into_iter().find(|it| it.name == name).expect("it is there");
        assert!(example.known().is_some());
        assert_eq!(example.with(change).known(), None, "{name}");
    };
    change("STREX r0, r1, [r4]", |it| it.tagged = Some(POINTER));
    change("STREX r0, r1, [r4]", |it| it.tagged = None);
    change("STREX r0, r1, [r4] to no memory", |it| it.board.r[0] = 0);
    change("STREX r0, r1, [r4] to no memory", |it| it.board.r[5] = 1);
    change("STREX r0, r1, [r4] to no memory", |it| it.witness.bfar = POINTER);
    change("STREX r0, r1, [r4] to no memory", |it| it.tagged = Some(0x0E00));
    change("BX r1", |it| it.before.r[1] |= 1);
    change("BX r1", |it| it.board.cfsr = 0);
    change("POP {pc}", |it| it.memory[1].1 |= 1);
    change("BX r1, and an interrupt", |it| it.witness.r[3] = 1);
    change("BX r1, and an interrupt", |it| it.board.r[3] = 1);
    change("BX r1, and an interrupt", |it| it.memory[3].1 = 1);
    change("BX r1, and an interrupt", |it| it.witness.r[15] = TARGET + 4);
    change("a fetch from a device", |it| it.memory = vec![(FRAME + 24, 0x2000_0000)]);
    change("no operation of a coprocessor", |it| it.code = [0xEE20, 0x0100]);
    change("LDR r0, [r4] across words of an alias", |it| it.before.r[4] = BIT_BAND.start);
    change("LDRH r0, [r4] of an alias, not aligned", |it| it.before.r[4] = BIT_BAND.start + 2);
    change("LDR r0, [r4] of a register of the core", |it| it.before.r[4] = POINTER);
    change("VFMA s0, s1, s2 of a denormal and a NaN", |it| it.before.s[0] = 0);
    change("VSUB s0, s1, s2 of a NaN", |it| it.before.s[2] = 0);
}
