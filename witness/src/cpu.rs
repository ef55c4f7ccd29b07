//! Two instruction interpreters held against each other: the virtual board's core and the second emulator's.
//!
//! Both begin with the same registers, memory and code, and must end with the same. Where they differ, the first instruction
//! after which they do is found and printed.

mod board;
mod chance;
mod functions;
mod known;
mod layout;
mod memory;
mod sequence;
mod state;
mod witness;

use std::collections::BTreeMap;

use rsemu::cpu::arm::v7m::isa::decode;

use chance::Chance;
use layout::{SHORT, SHORT_RAM, TABLE};
use sequence::{BEGIN, LENGTH, Sequence};
use state::{Difference, State};

pub use functions::run as functions;

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
}

impl Pair {
    fn new(regions: &[layout::Region]) -> Pair {
        let mut pair = Pair { board: board::Core::new(regions), witness: witness::Core::new(regions) };
        pair.write(TABLE.base, &layout::table());
        pair
    }

    fn write(&mut self, address: u32, bytes: &[u8]) {
        self.board.write(address, bytes);
        self.witness.write(address, bytes);
    }

    fn arrange(&mut self, state: &State) {
        self.board.arrange(state);
        self.witness.arrange(state);
    }

    fn run(&mut self, count: u64, seen: impl FnMut(u32)) {
        self.board.run(count, seen);
        self.witness.run(count);
    }

    /// The halfword at `address`, if there is memory.
    fn half(&self, address: u32) -> u16 {
        let mut half = [0; 2];
        if self.board.has(address) && self.board.has(address + 1) {
            self.board.read(address, &mut half);
        }
        u16::from_le_bytes(half)
    }

    /// In what they differ.
    fn differences(&mut self, ram: layout::Region) -> Vec<Difference> {
        let mut differences = self.board.state().differences(&self.witness.state());
        let length = ram.length as usize;
        let (mut ours, mut theirs) = (vec![0; length], vec![0; length]);
        self.board.read(ram.base, &mut ours);
        self.witness.read(ram.base, &mut theirs);
        if ours != theirs {
            let differing = (0..length / 4).map(|word| 4 * word).filter(|at| ours[*at..at + 4] != theirs[*at..at + 4]);
            differences.extend(differing.take(4).map(|at| Difference {
                what: format!("[{:#010x}]", ram.base as usize + at),
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

/// One sequence, and all it begins with.
struct Trial {
    sequence: Sequence,
    state: State,
    ram: Vec<u8>,
    /// After so many instructions an interrupt becomes pending.
    interrupt: Option<u64>,
}

impl Trial {
    fn new(seed: u64) -> Trial {
        let mut chance = Chance(seed);
        let c = &mut chance;
        let (sequence, state, ram) = (Sequence::new(c), sequence::state(c), sequence::ram(c));
        let interrupt = c.once_in(INTERRUPTED).then(|| u64::from(c.below(LENGTH as u32)));
        Trial { sequence, state, ram, interrupt }
    }

    /// Executes `count` instructions of it on both.
    fn run(&self, pair: &mut Pair, count: u64, mut seen: impl FnMut(u32)) {
        pair.write(SHORT_RAM.base, &self.ram);
        pair.arrange(&self.state);
        match self.interrupt.filter(|after| *after < count) {
            None => pair.run(count, seen),
            Some(after) => {
                pair.run(after, &mut seen);
                pair.board.interrupt();
                pair.witness.interrupt();
                pair.run(count - after, seen);
            }
        }
    }
}

/// What a campaign has shown.
#[derive(Default)]
pub struct Outcome {
    /// Runs that agreed, and runs in all.
    pub agreed: u64,
    /// All runs.
    pub all: u64,
    /// Runs that differed in a way that is decided, by the reason.
    pub known: BTreeMap<&'static str, u64>,
    /// Runs that differed otherwise, by the instruction.
    pub differing: BTreeMap<String, u64>,
    /// Instructions that were executed, by name.
    pub executed: BTreeMap<String, u64>,
    /// How runs ended: the exception, 0 for none.
    pub endings: BTreeMap<u32, u64>,
    /// Instructions that the board's fast path executed, of all.
    pub by_fast_path: u64,
}

/// Compares `count` sequences, from this seed on.
pub fn sequences(count: u64, seed: u64) -> Outcome {
    let mut pair = Pair::new(&SHORT);
    let mut outcome = Outcome::default();
    let mut printed = 0;
    for number in 0..count {
        let seed = seed.wrapping_add(number).wrapping_mul(0x2545_F491_4F6C_DD1D);
        let trial = Trial::new(seed);
        pair.write(BEGIN, &trial.sequence.bytes());
        let mut places = Vec::new();
        trial.run(&mut pair, EXECUTED, |pc| places.push(pc));
        let half = |pc: u32| {
            let at = pc.wrapping_sub(BEGIN) / 2;
            trial.sequence.code.get(at as usize).copied()
        };
        for pc in places {
            if let Some(first) = half(pc) {
                *outcome.executed.entry(name(first, half(pc + 2).unwrap_or_default())).or_default() += 1;
            }
        }
        *outcome.endings.entry(pair.board.state().exception()).or_default() += 1;
        outcome.all += 1;
        if pair.differences(SHORT_RAM).is_empty() {
            outcome.agreed += 1;
            continue;
        }
        let found = first_difference(&mut pair, &trial);
        if let Some(reason) = found.known {
            *outcome.known.entry(reason).or_default() += 1;
            continue;
        }
        let label = found.label.clone();
        if printed < PRINTED && !outcome.differing.contains_key(&label) {
            printed += 1;
            println!("{found}");
        }
        *outcome.differing.entry(label).or_default() += 1;
    }
    outcome.by_fast_path = pair.board.by_fast_path();
    outcome
}

/// Where two cores part.
struct Parting {
    known: Option<&'static str>,
    label: String,
    text: String,
}

impl std::fmt::Display for Parting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.text)
    }
}

/// Executes one instruction more each time until they differ.
fn first_difference(pair: &mut Pair, trial: &Trial) -> Parting {
    let mut before = trial.state.clone();
    for count in 1..=EXECUTED {
        // One enters the handler of a fault with the instruction, the other before the next one.
        trial.run(pair, count + 1, |_| {});
        let same_handler = pair.board.state().exception() == pair.witness.state().exception();
        let mut last = before.r[15];
        trial.run(pair, count, |pc| last = pc);
        let differences = pair.differences(SHORT_RAM);
        let (board, witness) = (pair.board.state(), pair.witness.state());
        let is_between = board.exception() != witness.exception() && same_handler && count < EXECUTED;
        if differences.is_empty() || is_between {
            before = board;
            continue;
        }
        let (first, second) = (pair.half(last), pair.half(last.wrapping_add(2)));
        let what: Vec<&str> = differences.iter().map(|difference| difference.what.as_str()).collect();
        let kind = if what.iter().any(|what| what.starts_with('[')) { "memory" } else { what[0] };
        let name = name(first, second);
        let lines: Vec<String> = differences.iter().map(|difference| format!("    {difference}")).collect();
        let text = format!(
            "after {count}, interrupt {:?}: {first:04x} {second:04x} {:?} at {last:#x}\n  before {:x?} xpsr {:08x} fpscr {:08x} s {:x?}\n{}",
            trial.interrupt,
            decode(first, second),
            before.r,
            before.xpsr,
            before.fpscr,
            before.s,
            lines.join("\n")
        );
        return Parting { known: known::known(&name, [&board, &witness], &differences), label: format!("{name} {kind}"), text };
    }
    Parting { known: None, label: "not again".to_owned(), text: "they differ at first, and not again".to_owned() }
}

/// The instruction's name in the emulator's decoder.
fn name(first: u16, second: u16) -> String {
    let text = format!("{:?}", decode(first, second));
    text.split([' ', '(']).next().unwrap_or_default().to_owned()
}
