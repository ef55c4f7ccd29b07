//! Two instruction interpreters held against each other: the virtual board's core and the second emulator's.
//!
//! Both begin with the same registers, memory and code, and must end with the same. Where they differ, the first instruction
//! after which they do is found and printed.

mod board;
mod chance;
mod code;
mod functions;
mod known;
mod layout;
mod memory;
mod sequence;
mod state;
mod witness;

use std::collections::BTreeMap;
use std::fmt;
use std::rc::Rc;

use rsemu::cpu::arm::v7m::isa::{Cond, Insn, decode};

use chance::Chance;
use code::Code;
use known::Parting;
use layout::{Region, SHORT, SHORT_RAM, TABLE};
use sequence::{BEGIN, LENGTH, Sequence};
use state::{Difference, Place, State};

pub use functions::functions;

/// Instructions that are executed of a sequence: all of it, and the interrupt's handler.
const EXECUTED: u64 = 2 * LENGTH as u64;
/// One in this many sequences is interrupted.
const INTERRUPTED: u32 = 3;
/// Differences that are printed.
const PRINTED: usize = 20;

/// Both cores, with the same memories.
struct Pair {
    board: board::Core,
    witness: witness::Core,
    ram: Vec<Region>,
}

impl Pair {
    fn new(regions: &[Region]) -> Pair {
        let ram = regions.iter().filter(|region| region.is_ram).copied().collect();
        let mut pair = Pair { board: board::Core::new(regions), witness: witness::Core::new(regions), ram };
        pair.write(TABLE.base, &layout::table());
        pair
    }

    fn write(&mut self, address: u32, bytes: &[u8]) {
        self.board.write(address, bytes);
        self.witness.write(address, bytes);
    }

    /// Gives both the same RAM, after a difference.
    fn even(&mut self) {
        for region in self.ram.clone() {
            let mut bytes = vec![0; region.length as usize];
            self.board.read(region.base, &mut bytes);
            self.witness.write(region.base, &bytes);
        }
    }

    /// The halfword at `address`, 0 if there is no memory.
    fn half(&self, address: u32) -> u16 {
        let mut half = [0; 2];
        if self.board.has(address) && self.board.has(address.wrapping_add(1)) {
            self.board.read(address, &mut half);
        }
        u16::from_le_bytes(half)
    }

    /// The word of RAM at `address` on the board's side, if there is one.
    fn ram_word(&self, address: u32) -> Option<u32> {
        let is_in = |region: &&Region| address.wrapping_sub(region.base) <= region.length - 4;
        self.ram.iter().find(is_in)?;
        let mut bytes = [0; 4];
        self.board.read(address, &mut bytes);
        Some(u32::from_le_bytes(bytes))
    }

    /// Executes `count` instructions of `trial` on both; calls `seen` with the address of each.
    fn run(&mut self, trial: &Trial, count: u64, mut seen: impl FnMut(u32)) {
        for (address, bytes) in &trial.memory {
            self.write(*address, bytes);
        }
        self.board.arrange(&trial.state);
        self.witness.arrange(&trial.state);
        let first = trial.interrupt.map_or(count, |after| after.min(count));
        if self.run_on(trial, first, &mut seen) && first < count {
            self.board.interrupt();
            self.witness.interrupt();
            self.run_on(trial, count - first, &mut seen);
        }
    }

    /// Executes `count` instructions more; whether that did not lead out of the code.
    fn run_on(&mut self, trial: &Trial, count: u64, seen: impl FnMut(u32)) -> bool {
        let left = self.board.run(count, &trial.code, seen);
        self.witness.run(left.unwrap_or(count));
        left.is_none()
    }

    /// In what they differ.
    fn differences(&mut self) -> Vec<Difference> {
        let mut differences = self.board.state().differences(&self.witness.state());
        for region in &self.ram {
            let length = region.length as usize;
            let (mut ours, mut theirs) = (vec![0; length], vec![0; length]);
            self.board.read(region.base, &mut ours);
            self.witness.read(region.base, &mut theirs);
            if ours == theirs {
                continue;
            }
            let differing = (0..length).step_by(4).filter(|at| word(&ours, *at) != word(&theirs, *at));
            differences.extend(differing.map(|at| Difference {
                place: Place::Memory(region.base + at as u32),
                ours: word(&ours, at),
                theirs: word(&theirs, at),
            }));
        }
        differences
    }
}

fn word(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(std::array::from_fn(|byte| bytes[at + byte]))
}

/// What both begin with.
struct Trial {
    memory: Vec<(u32, Vec<u8>)>,
    /// Where instructions begin.
    code: Rc<Code>,
    state: State,
    /// After this number of instructions an interrupt becomes pending.
    interrupt: Option<u64>,
    /// Instructions that are executed.
    executed: u64,
}

impl Trial {
    /// A random sequence.
    fn sequence(seed: u64) -> Trial {
        let mut chance = Chance(seed);
        let c = &mut chance;
        let sequence = Sequence::new(c);
        let memory = vec![(BEGIN, sequence.bytes()), (SHORT_RAM.base, sequence::ram(c))];
        let code = Rc::new(Code::new([(BEGIN, sequence.into_halves())]));
        let state = sequence::state(c);
        let interrupt = c.once_in(INTERRUPTED).then(|| u64::from(c.below(LENGTH as u32)));
        Trial { memory, code, state, interrupt, executed: EXECUTED }
    }
}

/// What a comparison has shown.
#[derive(Default)]
pub struct Outcome {
    /// Runs that agreed.
    agreed: u64,
    /// Runs.
    all: u64,
    /// Runs that differed in a way that is decided, by the reason.
    known: BTreeMap<&'static str, u64>,
    /// Runs that differed otherwise, by the instruction.
    differing: BTreeMap<String, u64>,
    /// Instructions that were executed, by the emulator's name.
    executed: BTreeMap<String, u64>,
    /// How runs ended: the exception, 0 for none.
    endings: BTreeMap<u32, u64>,
    /// Instructions that the board's fast path executed.
    by_fast_path: u64,
}

impl Outcome {
    /// Runs a trial and takes down what it shows.
    fn take(&mut self, pair: &mut Pair, trial: &Trial, mut seen: impl FnMut(u32)) {
        let mut places = Vec::new();
        pair.run(trial, trial.executed, |pc| places.push(pc));
        for pc in places {
            *self.executed.entry(name(pair.half(pc), pair.half(pc.wrapping_add(2)))).or_default() += 1;
            seen(pc);
        }
        *self.endings.entry(pair.board.state().exception()).or_default() += 1;
        self.all += 1;
        if pair.differences().is_empty() {
            self.agreed += 1;
            return;
        }
        pair.even();
        let found = first_difference(pair, trial);
        pair.even();
        if let Some(reason) = found.known {
            *self.known.entry(reason).or_default() += 1;
            return;
        }
        if self.differing.len() < PRINTED && !self.differing.contains_key(&found.label) {
            println!("{found}");
        }
        *self.differing.entry(found.label).or_default() += 1;
    }

    /// Whether all differences are known.
    pub fn is_good(&self) -> bool {
        self.all > 0 && self.differing.is_empty()
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let executed: u64 = self.executed.values().sum();
        writeln!(
            f,
            "{} runs, {} agree; {executed} instructions, {} by the fast path",
            self.all, self.agreed, self.by_fast_path
        )?;
        let endings: Vec<String> =
            self.endings.iter().map(|(exception, runs)| format!("{exception}: {runs}")).collect();
        writeln!(f, "ended in exception (0: none) {}", endings.join(", "))?;
        let names: Vec<String> =
            self.executed.iter().map(|(name, times)| format!("{name} {times}")).collect();
        writeln!(f, "executed: {}", names.join(", "))?;
        for (reason, runs) in &self.known {
            writeln!(f, "known: {runs} times {reason}")?;
        }
        for (label, runs) in &self.differing {
            writeln!(f, "DIFFERS: {runs} times {label}")?;
        }
        Ok(())
    }
}

/// Compares `count` random sequences, from this seed on.
pub fn sequences(count: u64, seed: u64) -> Outcome {
    let mut pair = Pair::new(&SHORT);
    let mut outcome = Outcome::default();
    for number in 0..count {
        // An odd factor: other numbers have other seeds.
        let seed = seed.wrapping_add(number).wrapping_mul(0x2545_F491_4F6C_DD1D);
        outcome.take(&mut pair, &Trial::sequence(seed), |_| {});
    }
    outcome.by_fast_path = pair.board.by_fast_path();
    outcome
}

/// What is to be said of the place where two cores part.
struct Finding {
    known: Option<&'static str>,
    label: String,
    text: String,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// Executes one instruction more each time until they differ.
fn first_difference(pair: &mut Pair, trial: &Trial) -> Finding {
    let mut before = trial.state.clone();
    let mut tagged = None;
    for count in 1..=trial.executed {
        let mut last = before.r[15];
        pair.run(trial, count, |pc| last = pc);
        let differences = pair.differences();
        let (board, witness) = (pair.board.state(), pair.witness.state());
        let code = [pair.half(last), pair.half(last.wrapping_add(2))];
        if differences.is_empty() {
            tagged = tag(tagged, code, &before, &board);
            before = board;
            continue;
        }
        if board.exception() != witness.exception()
            && count < trial.executed
            && meets_again(pair, trial, count)
        {
            continue;
        }
        let word = |address: u32| pair.ram_word(address);
        let parting = Parting {
            code,
            at: last,
            before: &before,
            board: &board,
            witness: &witness,
            differences: &differences,
            tagged,
            word: &word,
        };
        return finding(&parting, trial, count);
    }
    Finding {
        known: None,
        label: "not again".to_owned(),
        text: "they differ at first, and not again".to_owned(),
    }
}

/// The address that a LDREX has tagged, after this instruction.
fn tag(tagged: Option<u32>, code: [u16; 2], before: &State, after: &State) -> Option<u32> {
    let is_executed = !before.is_in_block() || Cond((before.xpsr >> 12 & 0xF) as u8).passes(before.xpsr);
    match decode(code[0], code[1]) {
        _ if before.exception() != after.exception() => None,
        Insn::LoadStoreExclusive { load: true, rn, imm, .. } if is_executed => {
            Some(before.r[usize::from(rn)].wrapping_add(imm))
        }
        Insn::LoadStoreExclusive { load: false, .. } | Insn::ClearExclusive if is_executed => None,
        _ => tagged,
    }
}

fn finding(parting: &Parting<'_>, trial: &Trial, count: u64) -> Finding {
    let Parting { code: [first, second], at, before, differences, .. } = parting;
    let is_memory = |difference: &&Difference| matches!(difference.place, Place::Memory(_));
    let kind = match differences.iter().find(is_memory) {
        Some(_) => "memory".to_owned(),
        None => differences[0].place.to_string(),
    };
    let lines: Vec<String> =
        differences.iter().take(PRINTED).map(|difference| format!("    {difference}")).collect();
    let text = format!(
        "after {count}, interrupt {:?}: {first:04x} {second:04x} {:?} at {at:#x}\n  before {:x?} xpsr {:08x} fpscr {:08x}\n  {:x?}\n{}",
        trial.interrupt,
        decode(*first, *second),
        before.r,
        before.xpsr,
        before.fpscr,
        before.s,
        lines.join("\n")
    );
    Finding { known: known::known(parting), label: format!("{} {kind}", name(*first, *second)), text }
}

/// Whether one enters the handler of a fault with the instruction, and the other before the next one: of the same fault, not of
/// one of its own.
fn meets_again(pair: &mut Pair, trial: &Trial, count: u64) -> bool {
    pair.run(trial, count + 1, |_| {});
    let (board, witness) = (pair.board.state(), pair.witness.state());
    board.exception() == witness.exception() && board.bfar == witness.bfar
}

/// The instruction's name in the emulator's decoder.
fn name(first: u16, second: u16) -> String {
    let text = format!("{:?}", decode(first, second));
    text.split([' ', '(']).next().unwrap_or_default().to_owned()
}
