//! The image's own functions, called with the same random arguments on both cores.
//!
//! Arguments are numbers, and pointers into RAM that holds numbers and pointers. Most calls end in a fault or return early;
//! what is compared is what the two made of the image's own code up to there.

use std::collections::BTreeSet;
use std::ops::Range;
use std::rc::Rc;

use object::read::elf::{ElfFile32, ProgramHeader};
use object::{Object, ObjectSymbol, SymbolKind};

use super::chance::Chance;
use super::code::Code;
use super::layout::{CCM, FLASH, RAM, STOP, WHOLE};
use super::state::State;
use super::{Outcome, Pair, Trial};

/// Instructions of a call, at most.
const EXECUTED: u64 = 2_000;
/// Words of RAM that are filled for a call; the rest is 0.
const FILLED: u32 = 0x400;
/// `xPSR`: Thumb state.
const T: u32 = 1 << 24;

/// Calls each function of the image `calls` times; returns the outcome and a line about what was reached.
pub fn functions(elf: &[u8], calls: u32, seed: u64) -> Result<(Outcome, String), String> {
    let file = ElfFile32::<object::Endianness>::parse(elf).map_err(|error| error.to_string())?;
    let mut pair = Pair::new(&WHOLE);
    let endian = object::Endianness::Little;
    for header in file.elf_program_headers() {
        let data = header.data(endian, elf).map_err(|()| "a segment outside the file")?;
        let address = header.p_paddr(endian);
        if !data.is_empty() && address.wrapping_sub(FLASH.base) < FLASH.length {
            pair.write(address, data);
        }
    }
    let is_function = |symbol: &object::read::elf::ElfSymbol32<'_, '_>| {
        symbol.kind() == SymbolKind::Text
            && symbol.size() > 0
            && (symbol.address() as u32).wrapping_sub(FLASH.base) < FLASH.length
    };
    let places: BTreeSet<(u32, u32)> = file
        .symbols()
        .filter(is_function)
        .map(|symbol| (symbol.address() as u32 & !1, symbol.size() as u32))
        .collect();
    let length: u32 = places.iter().map(|(_, size)| size).sum();
    let halves = |stretch: Range<u32>| stretch.step_by(2).map(|at| pair.half(at)).collect();
    let stretches = instructions(&file).into_iter().map(|stretch| (stretch.start, halves(stretch)));
    let code = Rc::new(Code::new(stretches));
    let mut chance = Chance(seed);
    let mut outcome = Outcome::default();
    let mut reached = BTreeSet::new();
    for (address, _) in &places {
        for _ in 0..calls {
            let trial = call(*address, &code, &mut chance);
            outcome.take(&mut pair, &trial, |pc| {
                reached.insert(pc);
            });
        }
    }
    outcome.by_fast_path = pair.board.by_fast_path();
    let bytes: u32 = reached.iter().map(|pc| if pair.half(*pc) >> 11 >= 0x1D { 4 } else { 2 }).sum();
    let line = format!("{} functions, {bytes} of {length} bytes of code reached", places.len());
    Ok((outcome, line))
}

/// Where the image has instructions: from each mapping symbol `$t` to the next one (ELF for the Arm architecture, section 5.5.5).
fn instructions(file: &ElfFile32<'_>) -> Vec<Range<u32>> {
    let mut marks: Vec<(u32, bool)> = file
        .symbols()
        .filter_map(|symbol| {
            let name = symbol.name().ok()?;
            let is_code = name.starts_with("$t");
            (is_code || name.starts_with("$d")).then_some((symbol.address() as u32, is_code))
        })
        .filter(|(address, _)| address.wrapping_sub(FLASH.base) < FLASH.length)
        .collect();
    marks.sort_unstable();
    marks.dedup_by_key(|(address, _)| *address);
    let ends = marks.iter().skip(1).map(|(end, _)| *end);
    let stretches = marks.iter().zip(ends).filter(|((_, is_code), _)| *is_code);
    stretches.map(|((start, _), end)| *start..end).collect()
}

/// A call of the function at `address`.
fn call(address: u32, code: &Rc<Code>, c: &mut Chance) -> Trial {
    let pointer = |c: &mut Chance| RAM.base + 4 * c.below(FILLED);
    let mut state = State { xpsr: T, control: 1 << 2, ..State::default() };
    for register in &mut state.r {
        *register = match c.below(8) {
            0..=3 => pointer(c),
            4 | 5 => c.below(64),
            6 => c.next() & 0xFFFF,
            _ => c.next(),
        };
    }
    state.r[13] = CCM.base + CCM.length - 0x400;
    state.r[14] = STOP | 1;
    state.r[15] = address;
    state.other_sp = CCM.base + 0x1000;
    let words = (0..FILLED).flat_map(|_| {
        let word = match c.below(4) {
            0 => pointer(c),
            1 => c.below(256),
            2 => c.next(),
            _ => 0,
        };
        word.to_le_bytes()
    });
    let mut ram: Vec<u8> = words.collect();
    ram.resize(RAM.length as usize, 0);
    let stack = vec![0; CCM.length as usize];
    Trial {
        memory: vec![(RAM.base, ram), (CCM.base, stack)],
        code: Rc::clone(code),
        state,
        interrupt: None,
        executed: EXECUTED,
    }
}
