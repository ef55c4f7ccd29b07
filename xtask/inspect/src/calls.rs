//! Who calls whom. An indirect call can reach what the table says, and only functions whose address is taken somewhere.
//!
//! The table and the image have to fit each other, so that neither grows stale: every function with an indirect call is in
//! some line (what several lines say of it adds up), every function whose address is taken is in some line, and every line is of
//! some use.

use std::collections::{BTreeMap, BTreeSet};

use crate::Error;
use crate::annotations::{Annotations, Pattern};
use crate::elf::{Image, THUMB};
use crate::frames::{Frame, Target};
use crate::instruction::Instruction;

/// A call that is known to be possible.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Edge {
    /// Address of the function that is called.
    pub to: u32,
    /// Bytes the caller has on the stack then.
    pub depth: u32,
}

/// The calls of every function, by its address.
pub type Graph = BTreeMap<u32, Vec<Edge>>;

/// Finds who can call whom.
pub fn graph(
    image: &Image,
    code: &BTreeMap<u32, Instruction>,
    frames: &BTreeMap<u32, Frame>,
    annotations: &Annotations,
) -> Result<Graph, Error> {
    let taken = taken(image, code);
    let callees = indirect(image, frames, annotations, &taken)?;
    let mut graph = Graph::new();
    for (&address, frame) in frames {
        let mut edges = BTreeSet::new();
        for call in &frame.calls {
            let depth = call.depth;
            match call.target {
                Target::Function(to) => {
                    edges.insert(Edge { to, depth });
                }
                Target::Indirect => {
                    let reached = callees.get(&address).into_iter().flatten();
                    edges.extend(reached.map(|&to| Edge { to, depth }));
                }
            }
        }
        graph.insert(address, edges.into_iter().collect());
    }
    Ok(graph)
}

/// The functions whose address is in a constant, or put together from its halves; but for what the vectors hold.
pub fn taken(image: &Image, code: &BTreeMap<u32, Instruction>) -> BTreeSet<u32> {
    let mut taken = BTreeSet::new();
    let mut take = |word: u32| {
        if word & THUMB != 0 && image.functions.contains_key(&(word & !THUMB)) {
            taken.insert(word & !THUMB);
        }
    };
    image.data.iter().flat_map(|bytes| bytes.words()).for_each(|(_, word)| take(word));
    let mut lower: BTreeMap<u16, u32> = BTreeMap::new();
    for (at, instruction) in code {
        if image.functions.contains_key(at) {
            lower.clear();
        }
        match instruction.half {
            Some((register, false, half)) => {
                lower.insert(register, half);
            }
            Some((register, true, half)) => take(half << 16 | lower.get(&register).copied().unwrap_or(0)),
            None => {}
        }
    }
    taken
}

/// Whom the indirect calls of each function can reach.
fn indirect(
    image: &Image,
    frames: &BTreeMap<u32, Frame>,
    annotations: &Annotations,
    taken: &BTreeSet<u32>,
) -> Result<BTreeMap<u32, BTreeSet<u32>>, Error> {
    let names = |address: &u32| image.functions.get(address).map_or(&[][..], |function| &function.names);
    let has_indirect = |frame: &Frame| frame.calls.iter().any(|call| call.target == Target::Indirect);
    let callers: Vec<u32> =
        frames.iter().filter(|(_, frame)| has_indirect(frame)).map(|(&address, _)| address).collect();
    let mut known = BTreeSet::new();
    let mut reached: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
    let mut wrong = Vec::new();
    let matching = |patterns: &[Pattern], among: &mut dyn Iterator<Item = &u32>| -> BTreeSet<u32> {
        let matches = |address: &&u32| patterns.iter().any(|pattern| pattern.matches_any(names(address)));
        among.filter(matches).copied().collect()
    };
    let first = |patterns: &[Pattern]| patterns.first().map_or("", |pattern| pattern.0.as_str()).to_owned();
    for line in &annotations.indirect {
        let callees = matching(&line.callees, &mut taken.iter());
        if callees.is_empty() {
            wrong.push(format!(
                "no code takes the address of `{}` and others of that line",
                first(&line.callees)
            ));
        }
        let callers = matching(&line.callers, &mut callers.iter());
        if callers.is_empty() {
            wrong.push(format!("no indirect call in `{}` and others of that line", first(&line.callers)));
        }
        for caller in callers {
            reached.entry(caller).or_default().extend(&callees);
        }
        known.extend(callees);
    }
    for line in &annotations.uncalled {
        let functions = matching(&line.functions, &mut taken.iter());
        if functions.is_empty() {
            wrong.push(format!(
                "no code takes the address of `{}` and others of that line",
                first(&line.functions)
            ));
        }
        known.extend(functions);
    }
    let unknown = callers.iter().filter(|caller| !reached.contains_key(caller));
    wrong.extend(unknown.map(|&caller| format!("whom does `{}` call indirectly?", image.name_of(caller))));
    let unknown = taken.difference(&known);
    wrong.extend(
        unknown.map(|&callee| format!("who calls `{}`, whose address is taken?", image.name_of(callee))),
    );
    if wrong.is_empty() { Ok(reached) } else { Err(Error::new(wrong.join("\n"))) }
}

/// The functions of this name; at least one.
pub fn find_all(image: &Image, pattern: &Pattern) -> Result<BTreeSet<u32>, Error> {
    let matching = image.functions.iter().filter(|(_, function)| pattern.matches_any(&function.names));
    let found: BTreeSet<u32> = matching.map(|(&address, _)| address).collect();
    if found.is_empty() {
        return Err(Error::new(format!("there is no function `{}`", pattern.0)));
    }
    Ok(found)
}

/// The one function of this name.
pub fn find(image: &Image, pattern: &Pattern) -> Result<u32, Error> {
    let found = find_all(image, pattern)?;
    match found.first() {
        Some(&only) if found.len() == 1 => Ok(only),
        _ => Err(Error::new(format!("there are several functions `{}`", pattern.0))),
    }
}
